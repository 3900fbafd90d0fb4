"""How fast to go towards a goal: as fast as allowed, and slow enough to stop in time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from base.planar import rotate
from services.messages import Array


@dataclass(frozen=True, slots=True)
class Approach:
    """Speed as a function of distance: proportional near the goal, braking curve, cruise.

    The square-root braking curve joins the proportional part with the same slope, so that the
    speed has no corner where a drive would jerk.

    Attributes:
        speed: cruise [m/s].
        turn: cruise [rad/s].
        deceleration: of the braking curve [m/s^2, rad/s^2].
        gain: of the proportional part [1/s].
    """

    speed: float = 0.5
    turn: float = 0.5
    deceleration: float = 0.4
    gain: float = 1.2

    def velocity(self, error: Array, heading: float) -> Array:
        """V_OB_B (3,) for an error (3,) expressed in O [m, m, rad] at the present heading [rad]."""
        distance = math.hypot(error[0], error[1])
        scale = self._along(distance, self.speed) / distance if distance > 1e-9 else 0.0
        turn = math.copysign(self._along(abs(error[2]), self.turn), error[2])
        return rotate(-heading, np.array([scale * error[0], scale * error[1], turn]))

    def _along(self, distance: float, cruise: float) -> float:
        linear = self.deceleration / self.gain**2
        if distance <= linear:
            return min(cruise, self.gain * distance)
        return min(cruise, math.sqrt(2 * self.deceleration * (distance - linear / 2)))
