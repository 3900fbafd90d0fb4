"""The joint reference: integrates wanted rates, and never jumps when what is wanted does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FADE = 0.06
"""Shortest time over which a change of mode fades in [s]."""
ACCELERATION = 1.5
"""Peak joint acceleration of that fade; larger changes take longer [rad/s^2]."""


class JointReference:
    """Positions and rates the torque law follows.

    Args:
        velocity_limit: shape (n,) [rad/s].
    """

    def __init__(self, velocity_limit: Array) -> None:
        self._limit = velocity_limit
        self.reset(np.zeros(len(velocity_limit)))

    def reset(self, q: Array) -> None:
        """Stand still at ``q``, shape (n,) [rad]."""
        self.q = q.copy()
        self.qd = np.zeros(len(q))
        self._switch = False
        self._offset = np.zeros(len(q))
        self._fade = 1.0
        self._fade_time = FADE
        self.clamped = False

    def switch(self) -> None:
        """Say that the next rates come from another mode: they fade in from the present ones."""
        self._switch = True

    @property
    def stopping(self) -> Array:
        """Where the joints would come to rest if they were switched to no motion, (n,) [rad]."""
        return self.q + 0.5 * _fade_time(self.qd) * self.qd

    def advance(self, dt: float) -> None:
        """Move the positions to the present instant with the rates of the last one."""
        self.q = self.q + self.qd * dt

    def follow(self, wanted: Array, dt: float) -> None:
        """Take new rates, shape (n,) [rad/s], within the velocity limits."""
        if self._switch:
            self._switch = False
            self._offset = self.qd - wanted
            self._fade_time = _fade_time(self._offset)
            self._fade = 0.0
        if self._fade < 1.0:
            self._fade = min(self._fade + dt / self._fade_time, 1.0)
            x = self._fade
            wanted = wanted + self._offset * (1.0 - x * x * (3.0 - 2.0 * x))
        excess = max(map(abs, (wanted / self._limit).tolist()))
        self.clamped = excess > 1.0
        self.qd = wanted / excess if self.clamped else wanted


def _fade_time(change: Array) -> float:
    """How long a change of rates [rad/s] takes; a smoothstep peaks at 1.5 times its mean rate."""
    return max(FADE, 1.5 * float(np.abs(change).max()) / ACCELERATION)
