"""The last millimetres to a pose, after something quicker has brought the platform near."""

from __future__ import annotations

import math

import numpy as np

from base.approach import Approach
from base.behaviour import Senses, Vote
from base.planar import difference
from services.messages import Array

_CALM = 0.5  # for which it stays within the tolerance before it has arrived [s]
_SMOOTH = 0.3  # time over which the error is averaged [s]


class Position:
    """Slow and straight, by the mean of the error over a few estimates.

    Args:
        goal: (3,) X_OB [m, m, rad].
        tolerance: of x, y together [m] and of the heading [rad]; it sets out again at thrice that.
    """

    name = "position"

    def __init__(self, goal: Array, tolerance: tuple[float, float] = (0.0015, 0.0015)) -> None:
        self._goal = np.array(goal, dtype=np.float64)
        self._tolerance = tolerance
        self._approach = Approach(speed=0.15, turn=0.2, deceleration=0.1, gain=1.2)
        self._error: Array | None = None
        self._newest = 0.0
        self._since: float | None = None
        self._arrived = False

    @property
    def state(self) -> str:
        """``driving`` or ``arrived``."""
        return "arrived" if self._arrived else "driving"

    def vote(self, now: float, senses: Senses) -> Vote:
        """The velocity towards the goal; exactly zero once it has stayed there."""
        error = difference(self._goal, senses.estimate.pose)
        if self._error is None or now - self._newest > _SMOOTH:
            self._error = error
        share = min((now - self._newest) / _SMOOTH, 1.0)
        self._newest = now
        # far away the mean would only be late
        far = math.hypot(error[0], error[1]) > 0.02 or abs(error[2]) > 0.02
        self._error = error if far else self._error + share * (error - self._error)
        scale = 3.0 if self._arrived else 1.0
        mean = self._error
        inside = (
            math.hypot(mean[0], mean[1]) <= scale * self._tolerance[0]
            and abs(mean[2]) <= scale * self._tolerance[1]
        )
        if not inside:
            self._since, self._arrived = None, False
        elif self._since is None:
            self._since = now
        if self._since is not None and now - self._since >= _CALM - 1e-9:
            self._arrived = True
        if self._arrived:
            return Vote(np.zeros(3))
        return Vote(self._approach.velocity(mean, senses.estimate.pose[2]))
