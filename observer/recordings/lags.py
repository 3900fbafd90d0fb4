"""How well the gyro explains the turns of the wheels, at every lag between their stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from observer.recordings.delay import EARLIEST, LATEST
from observer.recordings.increments import Turns, of_pose, of_rate
from observer.recordings.recording import Recording, Samples
from observer.recordings.series import Integral
from services.messages import Array

STEP = 0.005
"""Between two lags [s]."""
OVER = 0.3
"""Turns of a pose are taken over this long [s]: over one sample there is hardly more than
rounding."""


@dataclass(frozen=True)
class LagCurve:
    """One sensor's turns against the gyro's.

    Attributes:
        name: of the sensor.
        lag: stamps of the wheels behind those of the gyro (n,) [s].
        unexplained: share of the turning, root mean square, that the gyro does not explain (n,).
    """

    name: str
    lag: Array
    unexplained: Array


def lag_curves(recording: Recording, R_BI: Array) -> list[LagCurve]:
    """A curve for each sensor of the wheels that turns while the gyro runs.

    Args:
        recording: as read.
        R_BI: mounting of its IMU (3, 3).
    """
    imu = recording.imu
    if imu is None or len(imu) < 10:
        return []
    gyro = Integral(imu.t, imu.values[:, :3] @ R_BI[2])
    turns: list[tuple[str, Turns]] = []
    if recording.odometry is not None and len(recording.odometry) > 10:
        turns.append(("odometry", _over(recording.odometry)))
    if recording.speeds is not None and len(recording.speeds) > 10:
        s = recording.speeds
        turns.append(("speeds", of_rate(s.t, s.values[:, 2], s.period, -0.5 * s.period)))
    curves = [_curve(name, t, gyro) for name, t in turns]
    return [c for c in curves if c is not None]


def _over(odometry: Samples) -> Turns:
    every = max(round(OVER / odometry.period), 1)
    return of_pose(odometry.t[::every], odometry.values[::every, 2])


def _curve(name: str, turns: Turns, gyro: Integral) -> LagCurve | None:
    seen = (turns.start >= gyro.start + LATEST) & (turns.end <= gyro.end + EARLIEST)
    turns = turns.keep(np.asarray(seen))
    if len(turns) < 20 or float(np.std(turns.turned)) < 1e-6:
        return None
    lags = np.arange(EARLIEST, LATEST + STEP / 2, STEP)
    shares = []
    for lag in lags:
        by_gyro = gyro(turns.end - lag) - gyro(turns.start - lag)
        alike = float(np.corrcoef(by_gyro, turns.turned)[0, 1])
        shares.append(np.sqrt(max(1.0 - alike * alike, 0.0)))
    return LagCurve(name, lags, np.array(shares))
