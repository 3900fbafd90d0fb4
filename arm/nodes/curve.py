"""A curve in the plane, and how fast it is run through: slow in bends, at rest in corners."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from arm.nodes.node import Array

STEP = 2.5e-4
"""Distance of the points a curve is kept as [m]."""
CORNER = math.radians(30.0)
"""A sharper kink is a corner, in which the pen stops [rad]."""
WINDOW = 4
"""The bend at a point is that over so many steps to either side."""
SAMPLE = 0.001
"""Time between the samples of a time law [s]."""
SMOOTHING = 0.06
"""The time law is averaged over this time, which bounds its jerk [s]."""


@dataclass(frozen=True)
class Run:
    """A piece of a curve without corners; evenly spaced.

    Attributes:
        points: shape (n, 2) [m].
        length: [m].
    """

    points: Array
    length: float


class Curve:
    """What a polyline's points stand for, between corners smooth, by arc length.

    Args:
        vertices: of the polyline, dense where the curve bends, shape (m, 2) [m].

    Raises:
        ValueError: the polyline has no length.
    """

    def __init__(self, vertices: Array) -> None:
        steps = np.hypot(*np.diff(vertices, axis=0).T)
        kept = vertices[np.concatenate([[True], steps > 1e-7])]
        if len(kept) < 2:
            raise ValueError("a curve without length")
        d = np.diff(kept, axis=0)
        heading = np.arctan2(d[:, 1], d[:, 0])
        kinks = np.abs(_wrapped(np.diff(heading)))
        ends = [0, *(np.flatnonzero(kinks > CORNER) + 1), len(kept) - 1]
        self.runs = [_run(kept[a : b + 1]) for a, b in pairwise(ends)]
        self.length = sum(run.length for run in self.runs)
        self.points = np.concatenate([run.points for run in self.runs])
        self._s = np.concatenate(
            [
                start + np.linspace(0.0, run.length, len(run.points))
                for start, run in zip(self.starts(), self.runs, strict=True)
            ]
        )
        self._tangents = np.concatenate([_tangents(run.points) for run in self.runs])

    def starts(self) -> Array:
        """Arc length at which each run begins [m]."""
        return np.concatenate([[0.0], np.cumsum([run.length for run in self.runs])[:-1]])

    def at(self, s: float) -> tuple[Array, Array]:
        """Point [m] and unit tangent at arc length ``s`` [m], shapes (2,)."""
        i = int(np.searchsorted(self._s, s, side="right"))
        i = min(max(i, 1), len(self._s) - 1)
        gap = self._s[i] - self._s[i - 1]
        x = min(max((s - self._s[i - 1]) / gap, 0.0), 1.0) if gap > 0.0 else 0.0
        tangent = (1.0 - x) * self._tangents[i - 1] + x * self._tangents[i]
        point = (1.0 - x) * self.points[i - 1] + x * self.points[i]
        return point, tangent / max(float(np.hypot(*tangent)), 1e-9)


class CurveLaw:
    """Runs through a curve from rest to rest, as fast as speed and acceleration allow.

    At each point the speed is at most that at which bending takes the acceleration, and between
    points it changes by no more than the acceleration; averaging over ``SMOOTHING`` bounds the
    jerk to twice the acceleration over that time. Corners are passed at rest.

    Args:
        curve: to run through.
        speed: at most [m/s].
        acceleration: at most, along and across [m/s^2].
        start: arc length at which to begin [m].
    """

    def __init__(self, curve: Curve, speed: float, acceleration: float, start: float = 0.0) -> None:
        pieces = []
        for at, run in zip(curve.starts(), curve.runs, strict=True):
            skip = start - at
            if skip < run.length - 1e-9:
                pieces.append(at + _travel(run, speed, acceleration, max(skip, 0.0)))
        self._s = np.concatenate(pieces) if pieces else np.array([curve.length])
        self._v = np.gradient(self._s, SAMPLE) if len(self._s) > 1 else np.zeros(1)
        self._v[[0, -1]] = 0.0
        self._t = 0.0
        self._start = start

    @property
    def duration(self) -> float:
        """From rest to rest [s]."""
        return SAMPLE * (len(self._s) - 1)

    @property
    def done(self) -> bool:
        """Whether the end has been reached."""
        return self._t >= self.duration

    def again(self) -> CurveLaw:
        """The same law, from its beginning."""
        other = object.__new__(CurveLaw)
        other.__dict__.update(self.__dict__, _t=0.0)
        return other

    def step(self, dt: float) -> tuple[float, float]:
        """Advance by ``dt`` [s]; arc length since ``start`` [m], and speed [m/s]."""
        self._t = min(self._t + dt, self.duration)
        u = self._t / SAMPLE
        i = min(int(u), len(self._s) - 2)
        if i < 0:
            return float(self._s[0]) - self._start, 0.0
        x = u - i
        s = (1.0 - x) * self._s[i] + x * self._s[i + 1]
        v = (1.0 - x) * self._v[i] + x * self._v[i + 1]
        return float(s) - self._start, float(v)


def _run(vertices: Array) -> Run:
    steps = np.hypot(*np.diff(vertices, axis=0).T)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.linspace(0.0, s[-1], max(9, math.ceil(s[-1] / STEP) + 1))
    points = np.column_stack([np.interp(even, s, vertices[:, k]) for k in (0, 1)])
    return Run(points, float(s[-1]))


def _tangents(points: Array) -> Array:
    d = np.gradient(points, axis=0)
    return d / np.maximum(np.hypot(*d.T), 1e-12)[:, None]


def _wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def _travel(run: Run, speed: float, acceleration: float, skip: float) -> Array:
    """Arc length of a run every ``SAMPLE`` [m], from rest at ``skip`` [m] to rest at its end."""
    n = len(run.points)
    s = np.linspace(0.0, run.length, n)
    heading = np.unwrap(np.arctan2(*_tangents(run.points).T[::-1]))
    i = np.arange(n)
    lo, hi = np.maximum(i - WINDOW, 0), np.minimum(i + WINDOW, n - 1)
    bend = np.abs(heading[hi] - heading[lo]) / (s[hi] - s[lo])
    square = np.minimum(speed**2, acceleration / np.maximum(bend, 1e-9))
    if skip > 0.0:
        fine = np.linspace(skip, run.length, max(9, math.ceil((run.length - skip) / STEP) + 1))
        square, s = np.interp(fine, s, square), fine
    square[[0, -1]] = 0.0
    # v^2 may rise by 2 a ds and fall by as much
    rise = 2.0 * acceleration * s
    square = np.minimum.accumulate(square - rise) + rise
    square = (np.minimum.accumulate((square + rise)[::-1]) - rise[::-1])[::-1]
    v = np.sqrt(np.maximum(square, 0.0))
    gaps = np.diff(s)
    t = np.concatenate([[0.0], np.cumsum(2.0 * gaps / (v[:-1] + v[1:]))])
    at = np.linspace(0.0, t[-1], max(2, math.ceil(t[-1] / SAMPLE) + 1))
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(gaps) - 1)
    into = at - t[k]
    along = (square[k + 1] - square[k]) / (2.0 * gaps[k])
    exact = s[k] + v[k] * into + 0.5 * along * into**2
    width = round(SMOOTHING / SAMPLE)
    padded = np.concatenate([np.full(width, exact[0]), exact, np.full(width, exact[-1])])
    sums = np.concatenate([[0.0], np.cumsum(padded)])
    return np.asarray((sums[width:] - sums[:-width]) / width)
