"""Disturbances of one world: those of its scenario, and those that are asked for while it runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sim.disturbance import Timed, refuse_absent
from sim.effects import Effects, effects_at


class Timeline:
    """What goes wrong when.

    Args:
        disturbances: of the scenario.
        bodies: names of what can be pushed; also an attribute.

    Raises:
        ValueError: one of them pushes what is not there.
    """

    def __init__(self, disturbances: Iterable[Timed], bodies: Sequence[str]) -> None:
        self.bodies = bodies
        self._disturbances = list(disturbances)
        for disturbance in self._disturbances:
            self.refuse(disturbance)

    def refuse(self, disturbance: Timed) -> None:
        """Raise ValueError for a push on what is not there."""
        refuse_absent(disturbance, self.bodies)

    def add(self, disturbance: Timed, now: float) -> None:
        """Add a disturbance; those that ended before robot time ``now`` [s] are forgotten."""
        self._disturbances = [d for d in self._disturbances if d.end > now] + [disturbance]

    def at(self, now: float) -> Effects:
        """What acts at robot time ``now`` [s]."""
        return effects_at(now, self._disturbances)
