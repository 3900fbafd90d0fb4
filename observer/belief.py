"""What the filter knows right after one measurement: the unit of its history."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from services.messages import Array

IMU, ODOMETRY = 0, 1
NAMES = ("imu", "odometry")
_ZERO = np.zeros(3)


class Event(NamedTuple):
    """A measurement at the instant it was sampled; tuples of (t, sensor) order the history."""

    t: float
    sensor: int
    z: Array


@dataclass(frozen=True, slots=True)
class Belief:
    """State and covariance after a measurement, and all that the next one depends on.

    Arrays are never written to after construction, so that a snapshot costs no copy.
    """

    t: float
    x: Array
    """(12), see motion_model."""
    P: Array
    """(12, 12)."""
    odometry: Array
    """Newest odometry pose (3), fused or not."""
    repeats: tuple[int, int, int] = (0, 0, 0)
    """Times in a row that x, y, heading came unchanged."""
    unchanged_since: float = 1e300
    """Instant of the first of the newest odometry values that are equal in all three [s]."""
    odometry_innovation: Array = field(default_factory=lambda: _ZERO)
    odometry_nis: float = 0.0
    imu_innovation: Array = field(default_factory=lambda: _ZERO)
    imu_nis: float = 0.0
    odometry_refused: int = 0
    """Odometry refused by the gate in a row."""
    imu_refused: int = 0
    """IMU readings refused by the gate in a row."""
    odometry_gated: int = 0
    """Odometry refused by the gate since start."""
    imu_gated: int = 0
    """IMU readings refused by the gate since start."""
    alert_until: float = -1e300
    """Until then the disturbance is taken to be large [s]."""
    standing: bool = False
    """Whether the platform is taken to be held by its brakes and friction."""
    slip_until: float = -1e300
    """Until then slip is reported [s]."""
