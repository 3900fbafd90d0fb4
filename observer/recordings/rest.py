"""What sensors say while the platform stands, and how noisy they are when it does not."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from observer.recordings.figure import Figure, untold
from observer.recordings.recording import Samples
from observer.recordings.series import runs, spread
from services.messages import Array

WINDOW = 0.5
"""Standing is judged over this long [s]."""
STILL = (0.002, 0.003)
"""Motion over a window that still is standing [m], [rad]; or two steps of the rounding."""
SHORTEST = 1.5
"""A stand is no shorter [s]."""
TRIM = 0.3
"""Taken off at both ends, where the platform may still have moved [s]."""
QUIET = 5.0
"""A stand in which the gyro is this much noisier than in the quietest is none."""


@dataclass(frozen=True)
class Stand:
    """A stretch in which the platform stands.

    Attributes:
        start, end: by the gyro's stamps [s].
        gyro_bias: yaw rate that the gyro reads [rad/s].
        sigma: its standard deviation.
        gyro_noise: per sample [rad/s].
        accel_noise: per sample, of a horizontal axis [m/s^2].
    """

    start: float
    end: float
    gyro_bias: float
    sigma: float
    gyro_noise: float
    accel_noise: float


def standing(wheels: Samples, pose: bool, resolution: tuple[float, float]) -> list[tuple[int, int]]:
    """Stretches of samples between which the wheels do not move, as (first, behind last).

    Args:
        wheels: poses or speeds.
        pose: which of the two.
        resolution: of position [m] and heading [rad].
    """
    if len(wheels) < 3:
        return []
    far = max(STILL[0], 2.01 * resolution[0])
    turn = max(STILL[1], 2.01 * resolution[1])
    if pose:
        half = max(round(0.5 * WINDOW / wheels.period), 1)
        padded = np.pad(wheels.values, ((half, half), (0, 0)), mode="edge")
        moved = np.abs(padded[2 * half :] - padded[: -2 * half])
        still = (np.hypot(moved[:, 0], moved[:, 1]) <= far) & (moved[:, 2] <= turn)
    else:
        v = np.abs(wheels.values)
        still = (np.hypot(v[:, 0], v[:, 1]) <= far / WINDOW) & (v[:, 2] <= turn / WINDOW)
    still[1:] &= np.diff(wheels.t) < 5.0 * wheels.period
    t = wheels.t
    return [(a, b) for a, b in runs(still) if t[b - 1] - t[a] >= SHORTEST]


def stands(
    wheels: Samples, pose: bool, resolution: tuple[float, float], imu: Samples, delay: float
) -> list[Stand]:
    """What a levelled IMU reads while the wheels stand.

    Args:
        wheels: poses or speeds.
        pose: which of the two.
        resolution: of position [m] and heading [rad].
        imu: in axes whose z points up.
        delay: of the wheels' stamps behind the IMU's [s].
    """
    out = []
    for a, b in standing(wheels, pose, resolution):
        start = float(wheels.t[a] - delay + TRIM)
        end = float(wheels.t[b - 1] - delay - TRIM)
        part = imu.between(start, end)
        if len(part) < 10:
            continue
        turned, noise = 0.0, 0.0
        if pose:  # creeping shows in odometry, as well as it can be read
            turned = float(wheels.values[b - 1, 2] - wheels.values[a, 2])
            noise = math.sqrt(2.0 / 12.0) * resolution[1]
            turned = turned if abs(turned) > resolution[1] else 0.0
        long = float(wheels.t[b - 1] - wheels.t[a])
        gyro, force = part.values[:, 2], part.values[:, 3:]
        sd = _detrended(gyro)
        out.append(
            Stand(
                start=start,
                end=end,
                gyro_bias=float(np.mean(gyro)) - turned / long,
                sigma=max(math.hypot(sd / math.sqrt(len(part)), noise / long), 1e-7),
                gyro_noise=sd,
                accel_noise=math.sqrt(0.5 * sum(_detrended(force[:, i]) ** 2 for i in (0, 1))),
            )
        )
    if out:
        quietest = min(s.gyro_noise for s in out)
        out = [s for s in out if s.gyro_noise <= QUIET * max(quietest, 1e-6)]
    return out


def rough(t: Array, values: Array) -> float:
    """Noise of a sampled signal that otherwise moves smoothly.

    How far each sample lies from the cubic through the two before and the two after it.

    Args:
        t: instants (n,) [s], increasing.
        values: (n,).
    """
    if len(t) < 5:
        return 0.0
    x = np.stack([t[i : len(t) - 4 + i] - t[2:-2] for i in (0, 1, 3, 4)])
    weight = np.ones_like(x)
    for i in range(4):
        for j in range(4):
            if i != j:
                weight[i] *= x[j] / (x[j] - x[i])
    y = np.stack([values[i : len(t) - 4 + i] for i in (0, 1, 3, 4)])
    off = values[2:-2] - (weight * y).sum(axis=0)
    return spread(off / np.sqrt(1.0 + (weight**2).sum(axis=0)))


def mean_bias(found: list[Stand]) -> Figure:
    """Gyro bias over all stands [rad/s]."""
    if not found:
        return untold("the platform never stands for 1.5 s")
    weight = np.array([s.sigma**-2 for s in found])
    bias = np.array([s.gyro_bias for s in found])
    mean = float(weight @ bias / weight.sum())
    scatter = math.sqrt(float(weight @ (bias - mean) ** 2) / weight.sum() / len(bias))
    return Figure(mean, max(scatter, 1.0 / math.sqrt(weight.sum())))


def _detrended(values: Array) -> float:
    """Standard deviation (n,) about a straight line."""
    x = np.linspace(-1.0, 1.0, len(values))
    slope = float(x @ (values - values.mean())) / float(x @ x)
    return float(np.std(values - slope * x, ddof=2))
