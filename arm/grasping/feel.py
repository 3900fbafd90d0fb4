"""What the palms feel: forces and moments of the load cells, filtered, and which palm touches."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from arm.grasping.model import SIDES

Array = NDArray[np.float64]

FILTER = 20.0
"""Of forces and moments [Hz]."""
LOAD_FILTER = 3.0
"""Of the load that a palm carries [Hz]."""
TOUCHES = 3.0
"""Force inward from which a palm touches [N], ..."""
LETS_GO = 1.5
"""... and below which it no longer does."""
BOUNCE = 0.06
"""A palm that loses touch for less than this bounces [s]."""


SHAKES = 0.02
"""A palm that was pushed the other way within this time shakes by itself [s]."""


class Feel:
    """The load cells, tick by tick.

    Attributes:
        force: pressing each palm outwards, left then right, shape (2,) [N].
        moment: of the world on each palm about x, y, z of its P, shape (2, 3) [N m].
        load: force of the world on each palm across its normal, in P, slowly filtered,
            shape (2, 3) [N]; and ``twist``, about its normal, shape (2,) [N m].
        raw: as ``force``, not filtered; ``pushed``: force of the world on each palm in P, not
            filtered, less what it was the other way just before, shape (2, 3) [N]. A cell feels the
            palm's own inertia as well: one that gave way to that would never come to rest.
        touches: which palm touches.
        yielding: which palm is pushed so hard that it gives way (``Yield``).
        peak: largest force on either palm since the start, not filtered [N].
    """

    def __init__(self) -> None:
        self.force = np.zeros(2)
        self.moment = np.zeros((2, 3))
        self.load = np.zeros((2, 3))
        self.twist = np.zeros(2)
        self.raw = np.zeros(2)
        self.pushed = np.zeros((2, 3))
        self.touches = [False, False]
        self.yielding = [False, False]
        self._since = [0.0, 0.0]
        self._before: deque[tuple[float, Array]] = deque()
        self.peak = 0.0

    @property
    def both(self) -> bool:
        """Both palms touch."""
        return self.touches[0] and self.touches[1]

    def step(self, wrench: Array, dt: float) -> None:
        """Take in what both cells say, shape (12,) [N, N m], ``dt`` [s] after the last."""
        w = wrench.reshape(2, 6)
        self._push(w[:, :3].copy(), dt)
        quick = -math.expm1(-2 * math.pi * FILTER * dt)
        slow = -math.expm1(-2 * math.pi * LOAD_FILTER * dt)
        for i, side in enumerate(SIDES):
            self.raw[i] = side * w[i, 1]
            self.force[i] += quick * (self.raw[i] - self.force[i])
            self.moment[i] += quick * (w[i, 3:] - self.moment[i])
            across = np.array([w[i, 0], 0.0, w[i, 2]])
            self.load[i] += slow * (across - self.load[i])
            self.twist[i] += slow * (w[i, 4] - self.twist[i])
            if self.force[i] > (LETS_GO if self.touches[i] else TOUCHES):
                self._since[i] = 0.0
                self.touches[i] = True
            else:
                self._since[i] += dt
                self.touches[i] = self.touches[i] and self._since[i] < BOUNCE
            self.peak = max(self.peak, float(np.linalg.norm(w[i, :3])))

    def _push(self, force: Array, dt: float) -> None:
        self._before = deque((age + dt, f) for age, f in self._before if age + dt < SHAKES)
        for i, now in enumerate(force):
            size = max(float(np.linalg.norm(now)), 1e-9)
            against = max((-float(f[i] @ now) / size for _, f in self._before), default=0.0)
            self.pushed[i] = now * max(1.0 - max(against, 0.0) / size, 0.0)
        self._before.append((0.0, force))
