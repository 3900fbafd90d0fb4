"""Paths: pose and velocity relative to the start pose, as functions of path time.

``velocity`` is the derivative of ``pose`` everywhere, and is itself continuous.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Protocol

import numpy as np

from deploy.task import CirclePath, PathSpec, PolylinePath, SwayPath
from services.messages import Array


class Path(Protocol):
    """A path that starts at (0, 0, 0).

    Attributes:
        duration: path time at which it has come to rest [s]; infinite if it never does.
    """

    duration: float

    def pose(self, s: float) -> Array:
        """(3,) x, y [m], heading [rad] at path time ``s`` [s]."""
        ...

    def velocity(self, s: float) -> Array:
        """(3,) derivative of ``pose`` [m/s, m/s, rad/s], in the frame of the start pose."""
        ...


def build(spec: PathSpec) -> Path:
    """The path that a task describes."""
    if isinstance(spec, SwayPath):
        return Sway(spec)
    if isinstance(spec, CirclePath):
        return Circle(spec)
    return Polyline(spec)


class Sway:
    """Sinusoids about the start pose. It starts at speed: the follower fades it in."""

    duration = math.inf

    def __init__(self, spec: SwayPath) -> None:
        self._amplitude = np.array([*spec.amplitude, math.radians(spec.yaw_deg)])
        self._frequency = np.array(spec.frequency)

    def pose(self, s: float) -> Array:
        """See ``Path``."""
        return self._amplitude * np.sin(self._frequency * s)

    def velocity(self, s: float) -> Array:
        """See ``Path``."""
        return self._amplitude * self._frequency * np.cos(self._frequency * s)


class Circle:
    """Counter-clockwise to the left of the start pose; a single turn starts and ends at rest."""

    def __init__(self, spec: CirclePath) -> None:
        self._radius = spec.radius
        self._rate = spec.speed / spec.radius
        self._tangent = 1.0 if spec.heading == "tangent" else 0.0
        self._turn = (
            None
            if spec.loop
            else Legs(np.array([[0.0], [2 * math.pi]]), [2 * math.pi / self._rate], self._rate)
        )
        self.duration = math.inf if self._turn is None else self._turn.duration

    def pose(self, s: float) -> Array:
        """See ``Path``."""
        angle, _ = self._angle(s)
        r = self._radius
        return np.array([r * math.sin(angle), r * (1 - math.cos(angle)), self._tangent * angle])

    def velocity(self, s: float) -> Array:
        """See ``Path``."""
        angle, rate = self._angle(s)
        r = self._radius
        return rate * np.array([r * math.cos(angle), r * math.sin(angle), self._tangent])

    def _angle(self, s: float) -> tuple[float, float]:
        if self._turn is None:
            return self._rate * s, self._rate
        return float(self._turn.position(s)[0]), float(self._turn.velocity(s)[0])


class Polyline:
    """Straight legs with smooth corners; a loop comes to rest at the start pose each time round."""

    def __init__(self, spec: PolylinePath) -> None:
        points = [(0.0, 0.0, 0.0), *spec.points]
        if spec.loop:
            points.append((0.0, 0.0, 0.0))
        kept = [points[0]]
        kept += [b for a, b in pairwise(points) if math.dist(a, b) > 1e-6]
        corners = np.array(kept)
        times = [
            max(math.hypot(dx, dy) / spec.speed, abs(turn) / spec.turn_rate)
            for dx, dy, turn in np.diff(corners, axis=0)
        ]
        self._legs = Legs(corners, times, spec.acceleration)
        self._lap = self._legs.duration if spec.loop else math.inf
        self.duration = math.inf if spec.loop else self._legs.duration

    def pose(self, s: float) -> Array:
        """See ``Path``."""
        return self._legs.position(math.fmod(s, self._lap))

    def velocity(self, s: float) -> Array:
        """See ``Path``."""
        return self._legs.velocity(math.fmod(s, self._lap))


class Legs:
    """Motion from rest through points to rest, at constant velocity between smooth blends.

    The velocity is a sum of smooth steps, one at each point; each step is symmetric about the
    instant of the corner, so that between blends the motion is on the straight leg, on time.

    Args:
        points: (n, d), none equal to the one before it.
        times: (n-1,) of each leg at constant velocity [s]; stretched where too short to blend.
        acceleration: mean of a blend, of the component that changes most [per s^2].
    """

    def __init__(self, points: Array, times: list[float], acceleration: float) -> None:
        legs = np.array(times)
        while True:
            velocity = np.diff(points, axis=0) / legs[:, None]
            rest = np.zeros((1, points.shape[1]))
            steps = np.diff(np.vstack([rest, velocity, rest]), axis=0)
            widths = np.abs(steps).max(axis=1) / acceleration
            # the two half blends of a leg must fit into it
            short = (widths[:-1] + widths[1:]) / 2 > legs
            if not short.any():
                break
            legs = np.where(short, legs * 1.05, legs)
        self._start = points[0].astype(np.float64)
        self._steps = steps
        self._widths = np.maximum(widths, 1e-9)
        self._begins = widths[0] / 2 + np.concatenate([[0.0], np.cumsum(legs)]) - widths / 2
        self.duration = float(self._begins[-1] + widths[-1])

    def position(self, s: float) -> Array:
        """(d,) at path time ``s`` [s]; at rest before 0 and after ``duration``."""
        u = (s - self._begins) / self._widths
        inside = np.clip(u, 0.0, 1.0)
        done = inside**3 - inside**4 / 2 + np.maximum(u - 1.0, 0.0)
        return self._start + (self._widths * done) @ self._steps

    def velocity(self, s: float) -> Array:
        """(d,) derivative of ``position``."""
        u = np.clip((s - self._begins) / self._widths, 0.0, 1.0)
        return (u * u * (3 - 2 * u)) @ self._steps
