"""The platform's drive: follows velocity commands like a first-order lag, within its limits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from deploy.robot import MobileBase
from services.messages import BaseCommand

Array = NDArray[np.float64]

WATCHDOG = 0.1
"""A command older than this [s] is silence: the drive brakes at its acceleration limit."""
BRAKE_LAG = 0.005
"""Time constant of the last bit of that braking [s]."""
HOLDING = (60.0, 60.0, 20.0)
"""What the wheels of a standing platform hold along x, y [N] and about the vertical [N m]."""
STANDSTILL = 1e-3
"""Speed below which the drive takes the platform for standing [m/s, rad/s]."""


ZERO = [0.0, 0.0, 0.0]


class Drive:
    """Force of the drive on the platform, and the floor's roughness under it.

    Args:
        robot: description (limits).
        inertia: mass along x, y [kg] and moment of inertia [kg m^2] that the drive accelerates.
        lag: time constant of the response [s].
        roughness: rms of the disturbance while driving, in B [m/s^2, m/s^2, rad/s^2].
        correlation: its correlation time [s].
        rng: source of the roughness.

    Attributes:
        standing: at rest and asked to stay: the wheels hold against up to ``HOLDING``.
    """

    def __init__(
        self,
        robot: MobileBase,
        inertia: Array,
        lag: float,
        roughness: Array,
        correlation: float,
        rng: np.random.Generator,
    ) -> None:
        self._speed = robot.platform.speed_limit
        self._acceleration = robot.platform.acceleration_limit
        self._inertia = inertia.tolist()
        self._lag = lag
        self.standing = True
        self._roughness = roughness
        self._correlation = correlation
        self._rng = rng
        self._disturbance = roughness * rng.standard_normal(3)

    def force(self, now: float, dt: float, command: BaseCommand | None, velocity: Array) -> Array:
        """Force on the platform in B, shape (3,) [N, N, N m].

        Args:
            now: robot time [s].
            dt: time since the last call [s].
            command: newest command, None before the first.
            velocity: V_WB_B, shape (3,).
        """
        silent = command is None or now - command.t > WATCHDOG
        wanted = ZERO if silent or command is None else command.velocity.tolist()
        rough = self._rough(dt).tolist()
        vx, vy, w = now_at = velocity.tolist()
        fastest = max(map(abs, now_at))
        self.standing = fastest < STANDSTILL and not any(wanted)
        driving = fastest > STANDSTILL
        lag = BRAKE_LAG if silent else self._lag
        force = [0.0, 0.0, 0.0]
        turning = (-w * vy, w * vx, 0.0)  # the drive steers B, which turns: v' = a - w x v
        for i in range(3):
            error = clamp(wanted[i], self._speed[i]) - now_at[i]
            a = clamp(error / lag, self._acceleration[i])
            a += turning[i]
            force[i] = self._inertia[i] * (a + rough[i] if driving else a)
        return np.array(force)

    def _rough(self, dt: float) -> Array:
        keep = math.exp(-dt / self._correlation)
        spread = math.sqrt(1.0 - keep * keep)
        self._disturbance = keep * self._disturbance + (
            spread * self._roughness * self._rng.standard_normal(3)
        )
        return self._disturbance


def clamp(x: float, limit: float) -> float:
    """``x`` within plus or minus ``limit``."""
    return min(max(x, -limit), limit)
