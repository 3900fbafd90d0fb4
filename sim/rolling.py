"""How a platform rolls: what its wheels see, what drives it, and what holds it when it stands."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from services.messages import BaseCommand
from sim.drive import Drive
from sim.effects import Effects

Array = NDArray[np.float64]
Holding = tuple[float, float, float]

FREE = (0.0, 0.0, 0.0)
"""Friction the drive of a moving platform does not make up for [N, N, N m]."""


class Rolling:
    """A drive on its wheels.

    Args:
        drive: of the platform.
        hold: sets the friction of the wheels along x, y [N] and about the vertical [N m].
        holding: that of a platform that stands.
        slow: wheels that are asked to stand hold the platform below this speed, even while the
            drive does not take it for standing [m/s, rad/s].
    """

    def __init__(
        self, drive: Drive, hold: Callable[[Holding], None], holding: Holding, slow: float = 0.0
    ) -> None:
        self._drive, self._hold = drive, hold
        self._holding, self._slow = holding, slow
        self._standing = False

    def force(
        self,
        now: float,
        command: BaseCommand | None,
        heading: float,
        velocity: Array,
        effects: Effects,
    ) -> list[float]:
        """Force of the drive on the platform in B along x, y [N] and about the vertical [N m].

        Args:
            now: robot time [s].
            command: newest velocity command, None before the first.
            heading: of B in W [rad].
            velocity: V_WB_W, shape (3,) [m/s, m/s, rad/s].
            effects: disturbances that act; the wheels do not see a slip.
        """
        seen = velocity - np.array([*effects.slip, 0.0]) if effects.slips else velocity
        x, y, w = seen.tolist()
        c, s = math.cos(heading), math.sin(heading)
        drive = self._drive
        force = drive.force(now, command, (c * x + s * y, c * y - s * x, w))
        still = drive.standing or (not drive.asked and max(abs(x), abs(y), abs(w)) < self._slow)
        standing = still and not (effects.slips and effects.slip.any())
        if standing != self._standing:
            self._standing = standing
            self._hold(self._holding if standing else FREE)
        return force


def on_platform(
    drive: Sequence[float], heading: float, effects: Effects, inertia: Callable[[], Array]
) -> Array:
    """Force on the platform in W, shape (3,) [N, N, N m].

    Args:
        drive: of the drive and what is touched, in B [N, N, N m].
        heading: of B in W [rad].
        effects: of these, slips and bumps accelerate the platform.
        inertia: gives what they accelerate along x, y [kg] and about the vertical [kg m^2].
    """
    c, s = math.cos(heading), math.sin(heading)
    x, y, turn = drive
    force = np.array([c * x - s * y, s * x + c * y, turn])
    if effects.yaw:
        force[2] += effects.yaw * inertia()[2]
    if effects.slips:
        force[:2] += inertia()[:2] * effects.slip_acceleration
    return force
