"""What the observer assumes beyond the robot's description, and the filter made of both."""

from __future__ import annotations

from dataclasses import dataclass, field

from deploy.robot import MobileBase
from observer.delayed_ekf import DelayedEKF
from observer.filter_options import FilterOptions
from observer.imm import ImmEKF
from observer.motion_model import MotionModel
from observer.output import OutputOptions
from observer.planar_ekf import PlanarEKF
from observer.report import Limits
from observer.sensor_models import ImuModel, OdometryModel, SpeedModel


@dataclass(frozen=True)
class ObserverOptions:
    """What the observer assumes beyond the robot's description; reasons in docs/observer.md."""

    disturbance_factor: float = 1.2
    """Disturbance assumed, over the stated one: too little is worse than too much."""
    imu_noise_factor: float = 1.2
    """IMU noise assumed, over the stated one: understating it ruins consistency."""
    command_latency: float = 0.0015
    """From the stamp of a command to the drive, beside the drive's own dead time [s]."""
    reported_floor: float = 12**-0.5
    """Deviation reported at least where odometry repeats one value, in steps of it; 0: none."""
    covariance_period: float = 0.010
    """The covariance is carried on to now this often when no data come [s]."""
    pause: float = 0.5
    """After a gap this long between ticks the output starts afresh [s]."""
    lost: tuple[float, float] = (1.0, 0.5)
    """Likewise if it is this far from the filter [m], [rad]."""
    jump: float = 0.01
    """If it thereby jumped by more than this, it is invalid for ``pause`` seconds [m or rad]."""
    filter: FilterOptions = field(default_factory=FilterOptions)
    output: OutputOptions | None = field(default_factory=OutputOptions)
    """None gives out the filter's belief as it is, steps and all."""
    undelayed: bool = False
    """Take every measurement as if sampled when it arrived: a baseline, not a way to work."""
    limits: Limits = field(default_factory=Limits)


def make_filter(robot: MobileBase, options: ObserverOptions) -> DelayedEKF:
    """A filter for a robot, from its description and what we assume beyond it."""
    factor, (a, b, c) = options.disturbance_factor, robot.platform.disturbance
    motion = MotionModel(
        lag=robot.platform.lag,
        acceleration_limit=robot.platform.acceleration_limit,
        disturbance=(factor * a, factor * b, factor * c),
        correlation=robot.platform.disturbance_time,
    )
    imu = ImuModel(
        motion=motion,
        position=robot.imu.position[:2],
        gyro_noise=max(robot.imu.gyro_noise * options.imu_noise_factor, 1e-6),
        accel_noise=max(robot.imu.accel_noise * options.imu_noise_factor, 1e-5),
    )
    kind = ImmEKF if options.filter.modes == "imm" else PlanarEKF
    ekf = kind(
        motion,
        OdometryModel(robot.odometry.resolution, robot.odometry.noise),
        SpeedModel(robot.odometry.speed_noise),
        imu,
        gyro_bias=robot.imu.gyro_bias,
        accel_bias=robot.imu.accel_bias,
        options=options.filter,
    )
    return DelayedEKF(ekf)
