"""Force objective: an admittance along one direction, and the filter in front of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.model import Kinematics

Array = NDArray[np.float64]


class LowPass:
    """Two first-order low-pass filters in series.

    Args:
        cutoff: of each [Hz]; infinite passes everything.
    """

    def __init__(self, cutoff: float) -> None:
        self.cutoff = cutoff
        self._first: float | None = None
        self.value = 0.0

    def step(self, x: float, dt: float) -> float:
        """Filter one sample taken ``dt`` [s] after the last; starts at the first sample."""
        if self._first is None or math.isinf(self.cutoff):
            self._first = self.value = x
            return x
        keep = math.exp(-2.0 * math.pi * self.cutoff * dt)
        self._first = keep * self._first + (1.0 - keep) * x
        self.value = keep * self.value + (1.0 - keep) * self._first
        return self.value


class Force(Objective):
    """Presses along a direction with a reference force: the tip moves at gain times the error.

    The direct way, a torque for the force, fails on a geared arm: its friction is worth many
    newtons at the tip. An admittance leaves friction to the position loop.

    Args:
        direction: unit vector in O along which the tool presses, shape (3,).
        gain: tip speed per newton of error [m/s/N].
        acceleration: largest change of the tip's speed [m/s^2].
        ramp: largest change of the reference force [N/s].
    """

    def __init__(
        self, direction: Array, gain: float, acceleration: float = 1.0, ramp: float = 4.0
    ) -> None:
        self.direction = direction
        self.gain = gain
        self.acceleration = acceleration
        self.ramp = ramp
        self.measured = 0.0
        self.reference = 0.0
        self._goal = 0.0
        self._speed = 0.0

    def begin(self, measured: float, speed: float) -> None:
        """Take over at the present force [N] and speed along the direction [m/s]."""
        self.measured = self.reference = measured
        self._speed = speed

    def press(self, goal: float, measured: float) -> None:
        """Set the force wanted and the (filtered) force measured [N]."""
        self._goal = goal
        self.measured = measured

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Speed along the direction, with ramped reference and bounded acceleration."""
        step = self.ramp * dt
        self.reference += min(max(self._goal - self.reference, -step), step)
        wanted = self.gain * (self.reference - self.measured)
        change = self.acceleration * dt
        self._speed += min(max(wanted - self._speed, -change), change)
        n = self.direction
        rate = np.array([self._speed - float(n @ kinematics.drift[:3])])
        return Rows(n[None, :] @ kinematics.J[:3], rate)
