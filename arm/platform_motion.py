"""What the arm takes the platform to be doing: the observer's estimate, brought to the present."""

from __future__ import annotations

import math

import numpy as np

from arm.model import STANDING, Base
from services.messages import Estimate

ESTIMATE_AGE = 0.045
"""An estimate older than this is not to be trusted [s]: 50 ms after a loss the arm is safe."""
STEADY = 0.3
"""Time constant with which the steady velocity takes over the observer's corrections [s]."""
FADE = 0.15
"""Time constant with which the platform's velocity fades once its estimate is gone [s]."""


class PlatformMotion:
    """Follows the estimate; without a usable one, lets the last known motion fade to rest.

    The observer bends its velocity so that its pose comes right without a step. A tool on a
    surface feels these bends as force and has no use for the pose along the surface's normal. So
    the motion carries a second, steady velocity: the acceleration, integrated, drawn to the
    velocity with ``STEADY``.

    Attributes:
        base: the motion at the instant of the last ``follow``.
        problem: why there is no usable estimate; empty if there is one.
    """

    def __init__(self) -> None:
        self.base = STANDING
        self.problem = ""

    def follow(self, dt: float, now: float, estimate: Estimate | None) -> str:
        """Advance to ``now`` [s], ``dt`` [s] after the last call; returns ``problem``."""
        self.problem = _unusable(now, estimate)
        if estimate is not None and not self.problem:
            self.base = self._brought_forward(dt, now - estimate.t, estimate)
        else:
            velocity = self.base.velocity * math.exp(-dt / FADE)
            self.base = Base(self.base.pose + velocity * dt, velocity, np.zeros(3))
        return self.problem

    def _brought_forward(self, dt: float, age: float, estimate: Estimate) -> Base:
        """What was estimated ``age`` [s] ago, now, with its acceleration kept."""
        acceleration = estimate.acceleration
        velocity = estimate.velocity + acceleration * age
        pose = estimate.pose + (estimate.velocity + velocity) * (0.5 * age)
        before = self.base.steady
        if before is None:
            return Base(pose, velocity, acceleration, velocity)
        steady = before + acceleration * dt
        steady += (velocity - steady) * -math.expm1(-dt / STEADY)
        return Base(pose, velocity, acceleration, steady)


def _unusable(now: float, estimate: Estimate | None) -> str:
    if estimate is None:
        return "no estimate of the platform yet"
    age = now - estimate.t
    if age < -ESTIMATE_AGE:
        return f"the arm is {-1000 * age:.0f} ms behind the estimate of the platform"
    if age > ESTIMATE_AGE:
        return f"estimate of the platform is {1000 * age:.0f} ms old"
    return "" if estimate.valid else f"estimate of the platform is invalid: {estimate.reason}"
