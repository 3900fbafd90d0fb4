"""The platform's drive: follows velocity commands like a first-order lag, within its limits."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from deploy.robot import MobileBase
from services.messages import BaseCommand
from sim.draws import normal_rows

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
        rng: source of the roughness; the drive's alone.
        dt: time between calls of ``force`` [s].

    Attributes:
        asked: the newest command asks it to move.
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
        dt: float,
    ) -> None:
        self._speed = robot.platform.speed_limit
        self._acceleration = robot.platform.acceleration_limit
        self._inertia = inertia.tolist()
        self._lag = lag
        self.asked, self.standing = False, True
        self._dt = dt
        self._rough: list[float] = (roughness * rng.standard_normal(3)).tolist()
        self._keep = math.exp(-dt / correlation)
        self._kicks = normal_rows(rng, math.sqrt(1.0 - self._keep * self._keep) * roughness)

    def force(
        self, now: float, command: BaseCommand | None, velocity: Sequence[float]
    ) -> list[float]:
        """Force on the platform in B along x, y [N] and about the vertical [N m].

        Args:
            now: robot time [s].
            command: newest command, None before the first.
            velocity: V_WB_B [m/s, m/s, rad/s].
        """
        silent = command is None or now - command.t > WATCHDOG
        wanted = ZERO if silent or command is None else command.velocity.tolist()
        rough = self._roughness()
        vx, vy, w = velocity
        fastest = max(abs(vx), abs(vy), abs(w))
        self.asked = any(wanted)
        self.standing = fastest < STANDSTILL and not self.asked
        driving = fastest > STANDSTILL
        lag = BRAKE_LAG if silent else self._lag
        force = []
        turning = (-w * vy, w * vx, 0.0)  # the drive steers B, which turns: v' = a - w x v
        for i in range(3):
            error = clamp(wanted[i], self._speed[i]) - velocity[i]
            a = clamp(error / lag, self._acceleration[i])
            a += turning[i]
            force.append(self._inertia[i] * (a + rough[i] if driving else a))
        return force

    def _roughness(self) -> list[float]:
        """The next of the floor's disturbances, in B [m/s^2, m/s^2, rad/s^2]."""
        kicks = next(self._kicks).tolist()
        self._rough = [
            self._keep * was + kick for was, kick in zip(self._rough, kicks, strict=True)
        ]
        return self._rough


def clamp(x: float, limit: float) -> float:
    """``x`` within plus or minus ``limit``."""
    return -limit if x < -limit else min(x, limit)
