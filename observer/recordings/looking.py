"""Which way an inertial unit looks, and how late odometry is, told by its accelerometer.

Acceleration of odometry and specific force, both in B and both between 0.1 and 1 Hz: below, gravity
on uneven ground hides the motion, above, rounding and shaking do. As complex numbers the two differ
by a factor whose angle is how far the unit is turned about the vertical.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from observer.recordings.delay import EARLIEST, LATEST
from observer.recordings.figure import Figure, untold
from observer.recordings.increments import bottom
from observer.recordings.recording import Samples
from observer.recordings.series import touches
from services.messages import Array

Squares = Callable[[float], tuple[complex, Array]]
Complex = NDArray[np.complexfloating[Any, Any]]

BAND = (0.1, 1.0)
"""[Hz]"""
PERIOD = 0.02
"""Of the common grid [s]."""
STEP = 0.02
"""Of the delays [s]."""
BLOCKS = 8
RIVAL = 16.0
"""Delays far from the best must cost this much more, in units of the noise."""
LIKELY = 0.1
"""Share of the accelerometer's squares that motion must explain."""
STRAIGHT = math.radians(8.0)
"""Largest standard deviation with which the direction counts as told [rad]."""
SHARP = 0.03
"""Likewise of the delay [s]."""


@dataclass(frozen=True)
class Looking:
    """What the accelerometer tells.

    Attributes:
        yaw: by how much to turn what was given about the vertical, so that it is in B [rad].
        delay: odometry behind the accelerometer [s].
        moved: acceleration of odometry in the band, root mean square [m/s^2].
    """

    yaw: Figure
    delay: Figure
    moved: float = math.nan


def look(
    odometry: Samples,
    imu: Samples,
    position: tuple[float, float],
    holes: list[tuple[float, float]],
    delay: float | None,
) -> Looking:
    """Compare odometry with a levelled inertial unit.

    Args:
        odometry: poses.
        imu: in axes whose z points up.
        position: p_BI along x and y of B [m].
        holes: gaps of either (start, end) [s].
        delay: of odometry's stamps [s], where the gyro told it; else it is looked for.
    """
    start = max(odometry.t[0] - EARLIEST, imu.t[0])
    end = min(odometry.t[-1] - LATEST, imu.t[-1])
    if end - start < 10.0:
        return _nothing("less than 10 s of odometry and accelerometer together")
    t = np.arange(start, end, PERIOD)
    top = min(BAND[1], 0.25 / odometry.period)
    pose, turn = _acceleration(odometry, imu, position, top, delay or 0.0)
    force = _band(_on(imu.t, imu.values[:, 3:5], t) @ np.array([1.0, 1j]), top)
    margin = round(2.0 / PERIOD)  # filters settle
    keep = ~touches(t - 5.0, t + 5.0, holes)
    keep[:margin] = keep[-margin:] = False
    if keep.sum() < 5.0 / PERIOD:
        return _nothing("no 10 s without a gap")

    def squares(lag: float) -> tuple[complex, Array]:
        """Factor, and the squares (n,) that it leaves."""
        a = pose(t + lag)[keep] + about
        k = complex(np.vdot(a, f) / max(float(np.vdot(a, a).real), 1e-12))
        return k, np.abs(f - k * a) ** 2

    f, about = force[keep], turn(t)[keep]
    effective = max((top - BAND[0]) * keep.sum() * PERIOD * 2.0, 4.0) / keep.sum()
    lags = np.arange(EARLIEST, LATEST, STEP)
    costs = np.array([float(np.sum(squares(lag)[1])) for lag in lags])
    total = float(np.sum(np.abs(f) ** 2))
    k = int(np.argmin(costs))
    moved = float(np.sqrt(np.mean(np.abs(pose(t)[keep] + about) ** 2)))
    if not costs[k] < (1.0 - LIKELY) * total:
        why = f"too little motion: odometry accelerates by {moved:.2g} m/s^2 rms"
        return Looking(untold(why), untold(why), moved=moved)
    late = _delay(lags, costs, k, squares, effective)
    at = delay if delay is not None else late.otherwise(float(lags[k]))
    factor, left = squares(at)
    return Looking(
        yaw=_yaw(factor, left, f, effective),
        delay=late,
        moved=moved,
    )


def _nothing(reason: str) -> Looking:
    return Looking(untold(reason), untold(reason))


def _on(t: Array, values: Array, grid: Array) -> Array:
    return np.stack([np.interp(grid, t, column) for column in values.T], axis=1)


def _band(signal: Complex, top: float, low: float | None = BAND[0]) -> Complex:
    """The signal (n,), complex, on the grid, between ``low`` and ``top`` [Hz]; no phase."""
    edge = top if low is None else (low, top)
    kind = "lowpass" if low is None else "bandpass"
    sos = butter(2, edge, kind, fs=1.0 / PERIOD, output="sos")
    return np.asarray(sosfiltfilt(sos, signal.real) + 1j * sosfiltfilt(sos, signal.imag))


def _acceleration(
    odometry: Samples, imu: Samples, position: tuple[float, float], top: float, delay: float
) -> tuple[CubicSpline, CubicSpline]:
    """In B, complex: of B by odometry at its stamps; of the unit about B by gyro at its own."""
    t = np.arange(odometry.t[0], odometry.t[-1], PERIOD)
    x, y, heading = CubicSpline(odometry.t, odometry.values)(t).T
    smooth = _band(x - x[0] + 1j * (y - y[0]), top, None)
    a = np.gradient(np.gradient(smooth, PERIOD), PERIOD) * np.exp(-1j * heading)
    s = np.arange(imu.t[0], imu.t[-1], PERIOD)
    w = _band(np.interp(s, imu.t, imu.values[:, 2]) + 0j, top, None).real
    lever = complex(*position)
    about = (1j * np.gradient(w, PERIOD) - w * w) * lever
    return CubicSpline(t, _band(a, top)), CubicSpline(s, _band(about, top))


def _delay(lags: Array, costs: Array, k: int, squares: Squares, effective: float) -> Figure:
    away = np.abs(lags - lags[k]) > 0.25
    unit = costs[k] / (2.0 * effective * len(squares(0.0)[1]))
    if k in (0, len(lags) - 1) or float(np.min(costs[away])) - costs[k] < RIVAL * unit:
        return untold("too little change of speed to tell one delay from another")
    fine = lags[k] + np.arange(-3, 4) * STEP
    parts = np.stack([squares(lag)[1] for lag in fine])
    best, curvature = bottom(fine, parts.sum(axis=1))
    if curvature <= 0.0:
        return untold("too little change of speed to tell one delay from another")
    sigma = math.sqrt(2.0 * float(parts.sum(axis=1).min()) / len(parts[0]) / curvature / effective)
    blocks = np.array_split(np.arange(parts.shape[1]), BLOCKS)
    without = [bottom(fine, np.delete(parts, block, axis=1).sum(axis=1))[0] for block in blocks]
    sigma = max(sigma, math.sqrt((BLOCKS - 1) * float(np.var(without))))
    if sigma > SHARP:
        return untold(f"only to within {1e3 * sigma:.0f} ms")
    return Figure(best, sigma)


def _yaw(factor: complex, left: Array, force: Complex, effective: float) -> Figure:
    signal = float(np.sum(np.abs(force) ** 2) - np.sum(left))
    noise = float(np.sum(left)) / 2.0 / (len(left) * effective)
    sigma = math.sqrt(noise / max(signal, 1e-12))
    if sigma > STRAIGHT:
        return untold(f"only to within {math.degrees(sigma):.0f} deg")
    # the unit reads R_IB a: the factor has the angle of B as the unit sees it
    return Figure(-math.atan2(factor.imag, factor.real), sigma)
