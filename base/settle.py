"""The last millimetres: stiff and slow, and the mean of a while says whether it is there.

The floor pushes a platform about by some millimetres a second for as long as it moves. So it is
held against that until it comes to rest within the tolerance, and left alone then.
"""

from __future__ import annotations

import math

import numpy as np

from base.planar import rotate, shorten
from services.messages import Array

_GAIN = 4.0  # [1/s]
_DAMPING = 0.5  # of the measured velocity, near the goal [1]
_NEAR = 0.03  # [m, rad]
_TIME = 0.35  # over which the error is averaged [s]
_CALM = 0.6  # for which the mean stays within the tolerance [s]


class Settle:
    """Brings an error below a tolerance.

    Args:
        tolerance: of x, y together [m] and of the heading [rad]; at thrice that it sets out again.

    Attributes:
        done: the mean of the error has stayed within the tolerance.
    """

    def __init__(self, tolerance: tuple[float, float]) -> None:
        self._tolerance = tolerance
        self._mean: Array | None = None
        self._newest = 0.0
        self._since: float | None = None
        self._left_alone = False
        self.done = False

    def velocity(self, now: float, error: Array, velocity: Array, heading: float) -> Array:
        """(3,) V_OB_B to command; zero well within the tolerance.

        Args:
            now: robot time [s].
            error: (3,) from the pose to the goal, in O [m, m, rad].
            velocity: (3,) V_OB_O of the platform.
            heading: of the platform [rad].
        """
        share = min(max(now - self._newest, 0.0) / _TIME, 1.0)
        self._newest = now
        self._mean = error if self._mean is None else self._mean + share * (error - self._mean)
        if self._beyond(self._mean, 3.0 if self.done else 1.0) or self._beyond(error, 4.0):
            self._since, self.done = None, False
        elif self._since is None:
            self._since = now
        self.done = self._since is not None and now - self._since >= _CALM - 1e-9
        self._left_alone = not self._beyond(error, 1.0 if self._left_alone else 0.4)
        if self._left_alone:
            return np.zeros(3)
        wanted = shorten(_GAIN * error, translation=0.12, turn=0.2)
        if max(np.abs(error)) < _NEAR:
            wanted = wanted - _DAMPING * velocity
        return rotate(-heading, wanted)

    def _beyond(self, error: Array, scale: float) -> bool:
        away = math.hypot(error[0], error[1])
        return away > scale * self._tolerance[0] or abs(error[2]) > scale * self._tolerance[1]
