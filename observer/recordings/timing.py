"""When the samples of a sensor came: rate, jitter, gaps, repetitions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from observer.recordings.recording import Samples
from observer.recordings.series import gaps, spread

GAP = 3.5
"""Times the period between two samples that is a gap."""
REPEATS = 20
"""Samples over which it is judged whether the platform moves."""
LEAP = (5.0, 0.1)
"""Odometry that moves this much faster than it ever does otherwise, and this far [m], leaps."""


@dataclass(frozen=True)
class Timing:
    """Timing of one sensor.

    Attributes:
        samples: how many.
        start, end: of the first and last [s].
        rate: one over the median period [Hz].
        jitter: standard deviation of the period, gaps aside [s].
        gaps: (start, end) of each pause [s].
        latency: median from sampling to arrival [s].
        latency_spread: its standard deviation, wild ones aside [s].
        repeated: share of samples that say exactly what the one before said.
    """

    samples: int
    start: float
    end: float
    rate: float
    jitter: float
    gaps: tuple[tuple[float, float], ...]
    latency: float
    latency_spread: float
    repeated: float


def timing(sensor: Samples) -> Timing:
    """Timing of a sensor with two samples at least."""
    steps = np.diff(sensor.t)
    period = float(np.median(steps))
    usual = steps[steps < GAP * period]
    late = sensor.arrival - sensor.t
    same = (np.diff(sensor.values, axis=0) == 0.0).all(axis=1)
    return Timing(
        samples=len(sensor),
        start=float(sensor.t[0]),
        end=float(sensor.t[-1]),
        rate=1.0 / period,
        jitter=float(np.std(usual)),
        gaps=tuple(gaps(sensor.t, GAP * period)),
        latency=float(np.median(late)),
        latency_spread=spread(late),
        repeated=float(np.mean(same)),
    )


def repeated_in_motion(odometry: Samples) -> float:
    """Share of poses that repeat the one before although the platform moves fast."""
    same = (np.diff(odometry.values, axis=0) == 0.0).all(axis=1)
    if len(same) < 2 * REPEATS:
        return 0.0
    step = np.hypot(*np.diff(odometry.values[:, :2], axis=0).T)
    way = np.convolve(step, np.ones(REPEATS), mode="same")
    fast = way > 0.5 * float(np.max(way))
    return float(np.mean(same[fast])) if way.max() > 0.0 and fast.sum() >= REPEATS else 0.0


def leaps(odometry: Samples) -> list[tuple[float, float]]:
    """Where odometry leaps: (instant [s], how far [m])."""
    step = np.hypot(*np.diff(odometry.values[:, :2], axis=0).T)
    speed = step / np.diff(odometry.t)
    most = float(np.percentile(speed, 99.0)) if len(speed) else 0.0
    at = np.flatnonzero((speed > LEAP[0] * most) & (step > LEAP[1]))
    return [(float(odometry.t[k + 1]), float(step[k])) for k in at]
