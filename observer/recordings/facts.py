"""Everything that is found out about a recording, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass

from observer.recordings.average import Average
from observer.recordings.bias import Step
from observer.recordings.delay import TurnFit
from observer.recordings.drive import Drive
from observer.recordings.figure import Figure, untold
from observer.recordings.inertial import Inertial
from observer.recordings.looking import Looking
from observer.recordings.timing import Timing


@dataclass(frozen=True)
class Wheels:
    """Odometry by itself.

    Attributes:
        resolution: step of x, y [m] and heading [rad]; 0 if not rounded, None if not told.
        noise: standard deviation before rounding, of x, y [m] and heading [rad].
        acceleration: along the axes of B, root mean square [m/s^2, m/s^2, rad/s^2].
        leaps: (instant [s], how far [m]).
        repeated: share of poses that repeat the one before although the platform moves.
    """

    resolution: tuple[float | None, float | None, float | None]
    noise: tuple[float, float, float]
    acceleration: tuple[float, float, float]
    leaps: tuple[tuple[float, float], ...]
    repeated: float


@dataclass(frozen=True)
class Diagnosis:
    """Everything found; None where there is no such sensor, or no two to compare.

    Attributes:
        name: of the recording.
        timing: by sensor.
        short: sensors with too few samples to tell anything.
        wheels: odometry by itself.
        inertial: the IMU by itself, and its mounting.
        pose: heading of odometry against the gyro.
        speeds: yaw rate of the speeds against the gyro, as if it were instantaneous.
        average_by_gyro: whether that yaw rate is a mean over the past, told by the gyro ...
        average_by_pose: ... and by odometry.
        looking: odometry against the accelerometer.
        bias_steps: when the gyro's bias moved.
        drive: how the platform answers commands.
        distance: distance by odometry over distance by reference.
        paths: distance [m] from the reference, root mean square after one rigid alignment, of
            ``pose``, ``scaled pose`` and ``gyro heading``.
        use: ``pose``, or ``speed``: steps of odometry under the gyro's heading.
        because: why.
    """

    name: str
    timing: dict[str, Timing]
    short: tuple[str, ...] = ()
    wheels: Wheels | None = None
    inertial: Inertial | None = None
    pose: TurnFit | None = None
    speeds: TurnFit | None = None
    average_by_gyro: Average | None = None
    average_by_pose: Average | None = None
    looking: Looking | None = None
    bias_steps: tuple[Step, ...] = ()
    drive: Drive | None = None
    distance: Figure | None = None
    paths: dict[str, float] | None = None
    use: str = "pose"
    because: str = ""

    @property
    def odometry_delay(self) -> Figure:
        """Stamps of odometry behind those of the IMU [s], by gyro or else by accelerometer."""
        if self.pose is not None and self.pose.delay.told:
            return self.pose.delay
        if self.looking is not None and self.looking.delay.told:
            return self.looking.delay
        return self.pose.delay if self.pose is not None else untold("no odometry with IMU")

    @property
    def speeds_delay(self) -> Figure:
        """Age of what the speeds say, by their stamps and those of the IMU [s]."""
        if self.average_by_gyro is not None and self.average_by_gyro.box.value:
            return self.average_by_gyro.delay
        return self.speeds.delay if self.speeds is not None else untold("no speeds with IMU")

    @property
    def gyro_bias(self) -> Figure:
        """Gyro bias about the vertical [rad/s], at rest or else against the wheels."""
        if self.inertial is not None and self.inertial.gyro_bias.told:
            return self.inertial.gyro_bias
        fit = self.pose or self.speeds
        if fit is None or fit.scale.value is None:
            return untold("the platform never stands, and wheels do not tell")
        seconds = max(t.end - t.start for t in self.timing.values())
        wander = math.sqrt(max(fit.noise.walk, 0.0) / seconds)
        return Figure(-fit.rate / fit.scale.value, wander / fit.scale.value)
