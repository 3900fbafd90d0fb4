"""Goals that the arm's program has for the platform; they come with the arm's status."""

from __future__ import annotations

from base.planar import wrap
from base.platform import Platform
from services.messages import ArmStatus


class ArmGoal:
    """Obeys each goal once, and stops for one that is taken back before it is reached.

    Asked to stand, the platform does so, and neither drives nor corrects its place.

    A goal replaces the platform's task, as one from a person does; a person may replace it in
    turn. What the program waits for it reads off the observer's estimate.

    Args:
        platform: that drives.

    Attributes:
        refused: why the newest goal is not driven to; empty if it is.
    """

    def __init__(self, platform: Platform) -> None:
        self._platform = platform
        self._number = 0
        self._stand = False
        self.refused = ""

    def heed(self, arm: ArmStatus | None) -> None:
        """Look at the newest status of the arm, None if it has said nothing."""
        if arm is not None and arm.stand != self._stand:
            self._stand = arm.stand
            if arm.stand:
                self._platform.set_behaviour("hold_still")
        number = 0 if arm is None else arm.goal_number
        if arm is None or number == self._number:
            return
        self._number = number
        self.refused = ""
        try:
            if number:
                x, y, heading = (float(v) for v in arm.goal)  # the program's heading is continuous
                self._platform.set_goal(x, y, wrap(heading))
            # one that cannot move sideways would set out anew, with a turn, when pushed
            elif self._platform.doing == "driving" or self._platform.differential:
                self._platform.set_behaviour("hold_still")
        except ValueError as error:
            self.refused = f"goal of the program refused: {error}"
