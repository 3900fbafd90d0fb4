"""The joint reference: integrates wanted rates, and never jumps when what is wanted does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FADE = 0.06
"""Shortest time over which a change of mode fades in [s]."""
ACCELERATION = 1.5
"""Peak joint acceleration of that fade; larger changes take longer [rad/s^2] ..."""
KEPT = 0.04
"""... unless a joint would come nearer to the end of its range than this by it [rad]."""


class JointReference:
    """Positions and rates the torque law follows.

    Args:
        velocity_limit: shape (n,) [rad/s].
        lower, upper: ends of the joints' ranges, shape (n,) [rad].
    """

    def __init__(self, velocity_limit: Array, lower: Array, upper: Array) -> None:
        self._limit, self._lower, self._upper = velocity_limit, lower, upper
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
        return self.q + 0.5 * self._time_for(self.qd) * self.qd

    def advance(self, dt: float) -> None:
        """Move the positions to the present instant with the rates of the last one."""
        self.q = self.q + self.qd * dt

    def follow(self, wanted: Array, dt: float) -> None:
        """Take new rates, shape (n,) [rad/s], within the velocity limits."""
        if self._switch:
            self._switch = False
            self._offset = self.qd - wanted
            self._fade_time = self._time_for(self._offset)
            self._fade = 0.0
        if self._fade < 1.0:
            self._fade = min(self._fade + dt / self._fade_time, 1.0)
            x = self._fade
            wanted = wanted + self._offset * (1.0 - x * x * (3.0 - 2.0 * x))
        excess = max(map(abs, (wanted / self._limit).tolist()))
        self.clamped = excess > 1.0
        self.qd = wanted / excess if self.clamped else wanted

    def _time_for(self, change: Array) -> float:
        """How long a change of rates, shape (n,) [rad/s], takes to fade [s].

        A smoothstep peaks at 1.5 times its mean rate, and takes the joints as far as half of the
        change would in that time.
        """
        gentle = 1.5 * float(np.abs(change).max()) / ACCELERATION
        left = np.where(change > 0.0, self._upper - self.q, self.q - self._lower) - KEPT
        short = 2.0 * left / np.maximum(np.abs(change), 1e-9)
        return max(FADE, min(gentle, float(short.min())))
