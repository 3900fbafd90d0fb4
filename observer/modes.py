"""The hybrid form: the platform is in a mode, and the mode decides how much disturbance to expect.

An automaton over what the filter sees, after the paper's hybrid systems::

                 told to stand, odometry unchanged
    DRIVING  ------------------------------------------->  STANDING
       ^     <-------------------------------------------     |
       |            odometry changes, or a command            |
       |  quiet for a while                  IMU disagrees    |
    DISTURBED  <--------------------------------------------- + (from DRIVING too)

The variance of the disturbance acceleration is scaled by the mode. An interacting-model filter
(`observer.imm`) weighs the same three modes instead of choosing; docs/observer.md compares them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from observer.commands import STILL, Command
from observer.filter_options import FilterOptions


class Mode(StrEnum):
    """What the platform is doing, as far as it matters to the filter."""

    DRIVING = "driving"
    STANDING = "standing"
    DISTURBED = "disturbed"


@dataclass(frozen=True, slots=True)
class ModeState:
    """The automaton's state.

    Attributes:
        mode: see `Mode`.
        until: `DISTURBED` ends here [s].
    """

    mode: Mode = Mode.DRIVING
    until: float = -1e300

    def scale(self, t: float, u: Command, options: FilterOptions) -> float:
        """Factor on the variance of the disturbance at ``t`` [s] under command ``u`` (3)."""
        if self.mode is Mode.DISTURBED and t <= self.until:
            return options.alert_factor
        if self.mode is Mode.STANDING and u == STILL:
            return options.standing_factor
        return 1.0

    def surprised(self, t: float, nis: float, options: FilterOptions) -> bool:
        """Whether an IMU reading of normalised innovation squared ``nis`` reveals a disturbance.

        False while one is already reckoned with.
        """
        known = self.mode is Mode.DISTURBED and t <= self.until
        return nis > options.alert_nis and not known

    def disturbed(self, t: float, options: FilterOptions) -> ModeState:
        """The state after a surprise at ``t`` [s]."""
        return ModeState(Mode.DISTURBED, t + options.alert_time)

    def after_odometry(self, t: float, at_rest: float, options: FilterOptions) -> ModeState:
        """The state after odometry at ``t`` [s].

        Args:
            t: instant of the odometry [s].
            at_rest: how long it has been unchanged and the drive told to stand [s].
            options: knobs.
        """
        if self.mode is Mode.DISTURBED and t <= self.until:
            return self
        # stamps are sums of periods: a nanosecond less is still long enough
        stands = at_rest >= options.standing_after - 1e-9
        return ModeState(Mode.STANDING if stands else Mode.DRIVING, self.until)
