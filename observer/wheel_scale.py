"""Undoes what wheels of the wrong size do to a pose that is the sum of their increments."""

from __future__ import annotations

import math
from bisect import bisect_left

import numpy as np

from observer.sensor_models import wrap
from services.messages import Array

_KEPT = 64


class WheelScale:
    """Takes poses that read ``scale`` times what is true; gives poses as right wheels would.

    A distance that is wrong by a factor stretches the path; a turn that is wrong by a factor bends
    it, so each increment is corrected in the platform's frame and added up again. A pose is
    corrected from the one sampled before it; one that arrives after its successor is exact to
    second order in the angle turned between its neighbours.

    Args:
        scale: of distance and of turn, what is read over what is true.
    """

    def __init__(self, scale: tuple[float, float]) -> None:
        self.scale = scale
        self._t: list[float] = []
        self._read: list[Array] = []
        self._right: list[Array] = []

    def correct(self, t: float, pose: Array) -> Array:
        """X_OB (3) as right wheels would give it, of a pose sampled at ``t`` [s]."""
        if self.scale == (1.0, 1.0) or not np.isfinite(pose).all():
            return pose
        i = bisect_left(self._t, t)
        if not self._t:
            right = np.array(pose, dtype=np.float64)
        else:
            j = max(i - 1, 0)
            right = self._carry(self._read[j], self._right[j], pose)
        self._t.insert(i, t)
        self._read.insert(i, np.array(pose, dtype=np.float64))
        self._right.insert(i, right)
        if len(self._t) > _KEPT:
            del self._t[0], self._read[0], self._right[0]
        return right

    def _carry(self, read: Array, right: Array, pose: Array) -> Array:
        distance, turn = self.scale
        turned = wrap(float(pose[2] - read[2]))
        a = read[2] + 0.5 * turned  # the heading half-way, as read and as it was
        b = right[2] + 0.5 * turned / turn
        dx, dy = (pose[:2] - read[:2]) / distance
        c, s = math.cos(b - a), math.sin(b - a)
        return right + np.array([c * dx - s * dy, s * dx + c * dy, turned / turn])
