"""The platform's drive: follows velocity commands like a first-order lag, within its limits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from deploy.robot import Robot
from services.messages import BaseCommand

Array = NDArray[np.float64]

WATCHDOG = 0.15
"""A command older than this [s] is taken for silence, and the drive brings the platform to rest."""
WHEEL_FRICTION = (60.0, 60.0, 20.0)
"""Coulomb friction of wheels and gears along x, y [N] and about the vertical [N m]."""
STANDSTILL = 1e-3
"""Speed below which the drive takes the platform for standing [m/s, rad/s]."""


class Drive:
    """Force of the drive on the platform, and the floor's roughness under it.

    Args:
        robot: description (limits).
        inertia: mass along x, y [kg] and moment of inertia [kg m^2] that the drive accelerates.
        lag: time constant of the response [s].
        roughness: rms of the disturbance while driving, in B [m/s^2, m/s^2, rad/s^2].
        correlation: its correlation time [s].
        rng: source of the roughness.
    """

    def __init__(
        self,
        robot: Robot,
        inertia: Array,
        lag: float,
        roughness: Array,
        correlation: float,
        rng: np.random.Generator,
    ) -> None:
        self._speed = np.array(robot.platform.speed_limit)
        self._acceleration = np.array(robot.platform.acceleration_limit)
        self._inertia = inertia
        self._lag = lag
        self._friction = np.array(WHEEL_FRICTION)
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
        if command is None or now - command.t > WATCHDOG:
            wanted = np.zeros(3)
        else:
            wanted = np.clip(command.velocity, -self._speed, self._speed)
        a = np.clip((wanted - velocity) / self._lag, -self._acceleration, self._acceleration)
        # asked to move, the drive makes up for the friction of its wheels; else it lets them hold
        direction = np.where(np.abs(velocity) > STANDSTILL, velocity, wanted) / STANDSTILL
        makeup = self._friction * np.clip(direction, -1.0, 1.0) * (wanted != 0.0)
        driving = bool(np.abs(velocity).max() > STANDSTILL)
        return self._inertia * (a + driving * self._rough(dt)) + makeup

    def _rough(self, dt: float) -> Array:
        keep = math.exp(-dt / self._correlation)
        spread = math.sqrt(1.0 - keep * keep)
        self._disturbance = keep * self._disturbance + (
            spread * self._roughness * self._rng.standard_normal(3)
        )
        return self._disturbance
