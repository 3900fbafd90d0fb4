"""What a world is like: the robot as described, the robot as it truly is, and what befalls it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from deploy.robot import MobileBase
from services.messages import Array

LAG = (0.9, 1.1)
"""True over stated lag of the drive, drawn uniformly."""
NOISE = (1.0, 1.5)
"""True over stated noise of the IMU, drawn uniformly."""
TINY = 1e-9
"""Stands for nothing where a description asks for a positive number."""


@dataclass(frozen=True)
class Conditions:
    """Everything that can be chosen about a world.

    The observer is told of rates and delays. It is told of nothing else here.
    """

    odometry_rate: float | None = None
    """[Hz]; None: as described."""
    odometry_delay: float | None = None
    """From sampling to arrival [s]; None: as described."""
    imu_delay: float | None = None
    """[s]; None: as described."""
    disturbance: float = 1.0
    """Factor on the stated disturbance, a first-order Gauss-Markov acceleration in B."""
    noise: float | None = None
    """True over stated noise of the IMU; None draws ``NOISE``."""
    lag: float | None = None
    """True over stated lag; None draws ``LAG``."""
    pushes: tuple[float, ...] = ()
    """Instants of a push of 200 N on 190 kg for 0.2 s, its direction in B drawn [s]."""
    slips: tuple[tuple[float, float, float, float], ...] = ()
    """(start, duration [s], dx, dy [m]): the wheels slip, odometry drifts by that much in O."""
    odometry_gap: tuple[float, float] = (1e9, 1e9)
    """No odometry is sampled in between [s]."""
    imu_gap: tuple[float, float] = (1e9, 1e9)
    """No reading of the IMU is sampled in between [s]."""
    stuck: bool = False
    """Friction holds the platform: the truth is exactly constant."""
    brakes: float = math.inf
    """Told to stand for so long [s], the platform is brought to rest by its brakes and held."""
    heading: float | None = None
    """At the start [rad]; None draws any."""
    tilt: tuple[float, float] = (0.0, 0.0)
    """Of the floor: horizontal components of gravity, fixed in O [m/s^2]; the IMU reads less by
    that, turned into B. The drive is taken to hold against it."""
    scale: tuple[float, float] | None = None
    """What odometry reads over what is true, of distance and of heading turned; None: as
    described."""
    imu_rotation: tuple[float, float, float] | None = None
    """True R_BI as roll, pitch, yaw [rad]; None: as described."""
    command_delay: float = 0.0
    """Dead time of the drive beyond the stated one, in whole milliseconds [s]."""
    stamp_error: float = 0.0
    """Odometry is stamped this much too late [s]."""

    def slipped(self, t: Array) -> Array:
        """By how much odometry has drifted in O until ``t`` (n,) [s]: (n, 3) [m, m, rad]."""
        out = np.zeros((len(t), 3))
        for start, length, dx, dy in self.slips:
            out[:, :2] += np.clip((t - start) / length, 0.0, 1.0)[:, None] * [dx, dy]
        return out


def described(robot: MobileBase, how: Conditions) -> MobileBase:
    """What the observer is told: the description, with the rate and delays of this world."""
    odometry = robot.odometry.model_copy(
        update={
            "rate": robot.odometry.rate if how.odometry_rate is None else how.odometry_rate,
            "delay": robot.odometry.delay if how.odometry_delay is None else how.odometry_delay,
        }
    )
    delay = robot.imu.delay if how.imu_delay is None else how.imu_delay
    imu = robot.imu.model_copy(update={"delay": delay})
    return MobileBase(platform=robot.platform, odometry=odometry, imu=imu)


def truly(told: MobileBase, how: Conditions, rng: np.random.Generator) -> MobileBase:
    """What the robot is, its lag and noise drawn unless chosen. It rounds, without other noise."""
    lag = rng.uniform(*LAG) if how.lag is None else how.lag
    noise = rng.uniform(*NOISE) if how.noise is None else how.noise
    platform = told.platform.model_copy(
        update={
            "lag": told.platform.lag * lag,
            "command_delay": told.platform.command_delay + how.command_delay,
            "disturbance": tuple(max(how.disturbance * d, TINY) for d in told.platform.disturbance),
        }
    )
    odometry = told.odometry.model_copy(
        update={
            "noise": (TINY, TINY, TINY),
            "scale": told.odometry.scale if how.scale is None else how.scale,
        }
    )
    imu = told.imu.model_copy(
        update={
            "gyro_noise": told.imu.gyro_noise * noise,
            "accel_noise": told.imu.accel_noise * noise,
            "rotation": told.imu.rotation if how.imu_rotation is None else how.imu_rotation,
        }
    )
    return MobileBase(platform=platform, odometry=odometry, imu=imu)
