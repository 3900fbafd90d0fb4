"""The inertial unit by itself: how it is mounted, how noisy it is, what it reads at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from observer.recordings.figure import Figure, untold
from observer.recordings.frames import axis_vector, level, matrix_of, nearest_axis, turned
from observer.recordings.log import auto_of
from observer.recordings.looking import Looking
from observer.recordings.recording import Recording, Samples
from observer.recordings.rest import Stand, mean_bias, rough
from services.messages import Array

SQUARE = math.radians(12.0)
"""A unit that looks along one of its axes but for this is taken to do so exactly [rad]."""
LIGHT = 2.0
"""An accelerometer that reads less in the mean has had gravity taken out [m/s^2]."""
ALONE = untold("no odometry to compare with")


@dataclass(frozen=True)
class Mounting:
    """How the unit sits on the platform.

    Attributes:
        R_BI: turns what it reads into B, (3, 3).
        up: its axis that is nearest to the vertical, as ``+y``.
        tilt: angle between that axis and gravity [rad]; nan without gravity.
        told: whether ``up`` was given rather than found.
        forward: its axis that is nearest to x of B; "" if unknown.
        forward_told: whether that was given rather than found.
        askew: what turning about the vertical the accelerometer asks for beyond ``R_BI`` as it was
            known before, [rad].
    """

    R_BI: Array
    up: str
    tilt: float
    told: bool
    forward: str
    forward_told: bool
    askew: Figure = ALONE

    def looked(self, looking: Looking) -> Mounting:
        """With what accelerometer and odometry say of the direction forward."""
        if self.forward_told or looking.yaw.value is None:
            return replace(self, askew=looking.yaw)
        R_BI = turned(self.R_BI, looking.yaw.value)
        axis, off = nearest_axis(R_BI[0])
        if off < max(SQUARE, 3.0 * looking.yaw.sigma):
            R_BI = level(R_BI[2], axis_vector(axis))
        return replace(self, R_BI=R_BI, forward=axis, askew=looking.yaw)


@dataclass(frozen=True)
class Inertial:
    """An inertial unit.

    Attributes:
        mounting: how it sits.
        gyro_noise: per sample, at rest [rad/s] ...
        gyro_rough: ... and over the whole recording, shaking included.
        accel_noise: likewise, of a horizontal axis [m/s^2].
        accel_rough: likewise.
        gyro_bias: yaw rate read at rest [rad/s].
        stands: what was read whenever the platform stood.
    """

    mounting: Mounting
    gyro_noise: Figure
    gyro_rough: float
    accel_noise: Figure
    accel_rough: float
    gyro_bias: Figure
    stands: tuple[Stand, ...]


def mounting_of(recording: Recording, imu: Samples) -> Mounting:
    """Mounting as described, or levelled by gravity where it is to be found."""
    auto = auto_of(recording)
    f = np.median(imu.values[:, 3:], axis=0)
    heavy = float(np.linalg.norm(f)) > LIGHT
    given = "imu.up" not in auto
    R_BI = matrix_of(recording.base.imu.rotation) if given else level(f)
    up, _ = nearest_axis(R_BI[2] if given or not heavy else f)
    cosine = float(axis_vector(up) @ f) / max(float(np.linalg.norm(f)), 1e-9)
    tilt = math.acos(min(max(cosine, -1.0), 1.0)) if heavy else math.nan
    forward_given = "imu.forward" not in auto
    forward = nearest_axis(R_BI[0])[0] if forward_given else ""
    return Mounting(R_BI, up, tilt, given, forward, forward_given)


def inertial(imu: Samples, mounting: Mounting, found: list[Stand]) -> Inertial:
    """What a unit reads.

    Args:
        imu: already in B.
        mounting: how that was done.
        found: what it reads while the platform stands.
    """
    none = untold("the platform never stands for 1.5 s")
    across = [rough(imu.t, imu.values[:, k]) for k in (3, 4)]
    return Inertial(
        mounting=mounting,
        gyro_noise=_middle([s.gyro_noise for s in found]) if found else none,
        gyro_rough=rough(imu.t, imu.values[:, 2]),
        accel_noise=_middle([s.accel_noise for s in found]) if found else none,
        accel_rough=math.hypot(*across) / math.sqrt(2.0),
        gyro_bias=mean_bias(found),
        stands=tuple(found),
    )


def _middle(values: list[float]) -> Figure:
    return Figure(float(np.median(values)), float(np.std(values)))
