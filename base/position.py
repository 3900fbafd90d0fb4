"""The last millimetres to a pose, after something quicker has brought the platform near."""

from __future__ import annotations

import numpy as np

from base.behaviour import Senses, Vote
from base.planar import difference
from base.settle import Settle
from services.messages import Array


class Position:
    """Slow and straight, and held there until the platform comes to rest.

    Args:
        goal: (3,) X_OB [m, m, rad].
        tolerance: of x, y together [m] and of the heading [rad]; it sets out again at thrice that.
    """

    name = "position"

    def __init__(self, goal: Array, tolerance: tuple[float, float] = (0.0015, 0.0015)) -> None:
        self._goal = np.array(goal, dtype=np.float64)
        self._settle = Settle(tolerance)

    @property
    def state(self) -> str:
        """``driving`` or ``arrived``."""
        return "arrived" if self._settle.done else "driving"

    def vote(self, now: float, senses: Senses) -> Vote:
        """The velocity towards the goal; exactly zero once it stands there."""
        estimate = senses.estimate
        error = difference(self._goal, estimate.pose)
        return Vote(self._settle.velocity(now, error, estimate.velocity, estimate.pose[2]))
