"""What the filter knows right after one measurement: the unit of its history."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from observer.modes import ModeState
from services.messages import Array

IMU, ODOMETRY, SPEED = 0, 1, 2
NAMES = ("imu", "odometry", "speed")
_ZERO = np.zeros(3)
_ZERO.setflags(write=False)
_DRIVING = ModeState()


class Event(NamedTuple):
    """A measurement at the instant it was sampled; tuples of (t, sensor) order the history."""

    t: float
    sensor: int
    z: Array


class Belief(NamedTuple):
    """State and covariance after a measurement, and all that the next one depends on.

    Arrays are never written to after construction, so that a snapshot costs no copy.
    """

    t: float
    x: Array
    """(14), see motion_model."""
    P: Array
    """(14, 14)."""
    odometry: Array
    """Newest odometry pose (3), fused or not."""
    repeats: tuple[int, int, int] = (0, 0, 0)
    """Times in a row that x, y, heading came unchanged."""
    unchanged_since: float = 1e300
    """Instant of the first of the newest odometry values that are equal in all three [s]."""
    odometry_innovation: Array = _ZERO
    odometry_nis: float = 0.0
    imu_innovation: Array = _ZERO
    imu_nis: float = 0.0
    odometry_deviation: Array = _ZERO
    """Of the innovation, from its covariance (3)."""
    imu_deviation: Array = _ZERO
    speed_nis: float = 0.0
    odometry_refused: int = 0
    """Odometry refused by the gate in a row."""
    imu_refused: int = 0
    """IMU readings refused by the gate in a row."""
    odometry_gated: int = 0
    """Odometry refused by the gate since start."""
    imu_gated: int = 0
    """IMU readings refused by the gate since start."""
    mode: ModeState = _DRIVING
    slip_until: float = -1e300
    """Until then slip is reported [s]."""
    hypotheses: tuple[Hypothesis, ...] = ()
    """What each mode believes; of `observer.imm` alone."""


class Hypothesis(NamedTuple):
    """One mode's belief and its probability."""

    x: Array
    P: Array
    weight: float
