"""Commands without jolts: every next command within speed, acceleration and jerk limits."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from services.messages import Array

_SAME = 1e-7  # closer than this to what is wanted, it is reached exactly [m/s, rad/s]


class JerkLimit:
    """The newest command with its rate of change, and which commands may follow.

    A command may only be given if the ones after it can level off below the speed limit without
    more jerk than allowed; so the limits can be kept for ever, whatever is asked for and when.

    Args:
        speed: (3,) limit of vx, vy, yaw rate [m/s, m/s, rad/s].
        acceleration: (3,) [m/s^2, m/s^2, rad/s^2].
        jerk: (3,) [m/s^3, m/s^3, rad/s^3].

    Attributes:
        command: (3,) newest V_OB_B [m/s, m/s, rad/s].
        rate: (3,) its rate of change over the step that led to it.
        levelling: (3,) speed gained while the full acceleration is let go, over the acceleration
            [s, s, s].
    """

    def __init__(
        self, speed: Iterable[float], acceleration: Iterable[float], jerk: Iterable[float]
    ) -> None:
        self._speed = np.array(list(speed))
        self._acceleration = np.array(list(acceleration))
        self._jerk = np.array(list(jerk))
        self.levelling = self._acceleration / (2 * self._jerk)
        self.command, self.rate = np.zeros(3), np.zeros(3)

    def copy(self) -> JerkLimit:
        """One that goes on from here by itself."""
        out = JerkLimit(self._speed, self._acceleration, self._jerk)
        out.command, out.rate = self.command.copy(), self.rate.copy()
        return out

    def reach(self, elapsed: float) -> tuple[Array, Array]:
        """Least and greatest of each component of the next command, ``elapsed`` [s] later."""
        lo, hi = np.zeros(3), np.zeros(3)
        for i in range(3):
            a, v = float(self.rate[i]), float(self.command[i])
            largest, change = float(self._acceleration[i]), float(self._jerk[i]) * elapsed
            up = min(largest, a + change, self._fastest(i, float(self._speed[i]) - v, elapsed))
            down = max(-largest, a - change, -self._fastest(i, float(self._speed[i]) + v, elapsed))
            # rounding must not turn the two round, and the jerk is the one that is kept
            up, down = max(up, a - change), min(down, a + change)
            lo[i], hi[i] = v + min(down, up) * elapsed, v + max(down, up) * elapsed
        return lo, hi

    def toward(self, wanted: Array, elapsed: float, drift: Array | None = None) -> Array:
        """(3,) the next command on the quickest way to ``wanted`` (3,) that does not overshoot.

        vx and vy change in proportion, as far as the limits let them: the course is kept.

        Args:
            wanted: (3,) V_OB_B.
            elapsed: since the newest command [s].
            drift: (3,) rate at which ``wanted`` changes and will change; it is followed.
        """
        drift = np.zeros(3) if drift is None else drift
        away = wanted - self.command - drift * elapsed
        rate = np.array([self._quickest(i, float(away[i]), elapsed) for i in range(3)])
        major = 0 if abs(away[0]) >= abs(away[1]) else 1
        minor = 1 - major
        if abs(away[major]) > 0:
            rate[minor] = rate[major] * away[minor] / away[major]
        out = self.command + (drift + rate) * elapsed
        near = np.abs(out - wanted) < _SAME
        out[near] = wanted[near]
        return np.clip(out, *self.reach(elapsed))

    def take(self, command: Array, elapsed: float) -> None:
        """This is the command now; it comes ``elapsed`` [s], not zero, after the last."""
        self.rate = (command - self.command) / elapsed
        self.command = command.copy()

    def _quickest(self, i: int, away: float, elapsed: float) -> float:
        rate = min(self._fastest(i, abs(away), elapsed), float(self._acceleration[i]))
        return math.copysign(rate, away)

    def _fastest(self, i: int, room: float, elapsed: float) -> float:
        """Largest acceleration from which the command levels off within ``room`` [m/s]."""
        if room <= 0:
            return 0.0
        jerk = float(self._jerk[i])
        change = jerk * elapsed
        return 2 * jerk * room / (change + math.sqrt(change * change + 2 * jerk * room))
