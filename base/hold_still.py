"""Keep the place where the platform stands."""

from __future__ import annotations

import math

import numpy as np

from base.approach import Approach
from base.behaviour import Senses, Vote
from base.planar import difference
from services.messages import Array


class HoldStill:
    """Commands exactly zero near its place, and returns gently when moved away from it.

    Between ``near`` and ``far`` it does nothing: an estimate that wanders by a few millimetres
    must not make the platform fidget under an arm at work.

    Args:
        near: where a return ends [m, rad].
        far: where a return begins [m, rad].
    """

    name = "hold_still"

    def __init__(self, near: float = 0.005, far: float = 0.03) -> None:
        self._near, self._far = near, far
        self._place: Array | None = None
        self._returning = False
        self._approach = Approach(speed=0.05, turn=0.1, deceleration=0.1, gain=1.0)

    @property
    def state(self) -> str:
        """``holding``, or ``returning`` to its place."""
        return "returning" if self._returning else "holding"

    def vote(self, now: float, senses: Senses) -> Vote:
        """Zero, or a slow return; the place is where the first vote found the platform."""
        pose = senses.estimate.pose
        if self._place is None:
            self._place = pose.copy()
        error = difference(self._place, pose)
        away = max(math.hypot(error[0], error[1]), abs(error[2]))
        self._returning = away > (self._near if self._returning else self._far)
        if not self._returning:
            return Vote(np.zeros(3))
        return Vote(self._approach.velocity(error, pose[2]))
