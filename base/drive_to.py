"""Drive to a pose and stay there."""

from __future__ import annotations

import numpy as np

from base.approach import Approach
from base.behaviour import Senses, Vote
from base.planar import difference, within
from services.messages import Array


class DriveTo:
    """Straight to the goal, turning the short way round meanwhile.

    It has arrived within the tolerance; it sets out again only when moved to thrice that, so
    that noise at the edge does not start and stop it.

    Args:
        goal: (3,) X_OB to reach [m, m, rad].
        approach: how fast.
        tolerance: of x, y together [m] and of the heading [rad].
    """

    name = "drive_to"

    def __init__(
        self,
        goal: Array,
        approach: Approach | None = None,
        tolerance: tuple[float, float] = (0.005, 0.01),
    ) -> None:
        self._goal = np.array(goal, dtype=np.float64)
        self._approach = approach or Approach()
        self._tolerance = tolerance
        self._arrived = False

    @property
    def state(self) -> str:
        """``driving`` or ``arrived``."""
        return "arrived" if self._arrived else "driving"

    def vote(self, now: float, senses: Senses) -> Vote:
        """The velocity towards the goal; exactly zero once there."""
        pose = senses.estimate.pose
        error = difference(self._goal, pose)
        self._arrived = within(error, self._tolerance, 3.0 if self._arrived else 1.0)
        if self._arrived:
            return Vote(np.zeros(3))
        return Vote(self._approach.velocity(error, pose[2]))
