"""A platform without dynamics of its own: for campaigns of hundreds of worlds in minutes.

The drive is the simulation's (first-order lag, limits, rough floor), laser and bumpers are the
same sensors; what is missing is the arm, whose inertia turns the simulated platform by 1 to 2
degrees when it sets off, the wheels' friction, and the observer, of which only the size of its
errors is kept.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from deploy.robot import Robot
from services.messages import Bumper, Estimate, Scan
from sim.bumpers import BumperSensor
from sim.disturbance import Timed
from sim.drive import clamp
from sim.effects import Effects, effects_at
from sim.laser import LaserSensor
from sim.obstacle_specs import Obstacle
from sim.obstacles import Obstacles
from sim.sensors import Wheels

Array = NDArray[np.float64]

PERIOD = 0.05
"""Time between two steps [s] ..."""
DT = 0.005
"""... in pieces of this [s]."""
QUICKEST = 2.0
"""No platform comes nearer to something that stands faster than this [m/s]."""


@dataclass(frozen=True)
class Imperfect:
    """How far the kinematic platform is from a perfect one; noises as standard deviations."""

    lag: float = 0.10
    """Of the platform's lag, relative, either way."""
    roughness: tuple[float, float, float] = (0.05, 0.05, 0.1)
    """Floor disturbance while driving, in B [m/s^2, m/s^2, rad/s^2] ..."""
    roughness_correlation: float = 0.3
    """... and its correlation time [s]."""
    scale: tuple[float, float] = (1.0, 1.0)
    """What the wheels read over what is true, of distance and of heading turned."""
    pose_noise: tuple[float, float, float] = (0.0005, 0.0005, 0.0005)
    """Of the estimate [m, m, rad]."""
    velocity_noise: tuple[float, float, float] = (0.003, 0.003, 0.003)
    """Of the estimate [m/s, m/s, rad/s]."""
    laser_noise: float = 1.0
    """Factor on the described noise."""


class KinematicRobot:
    """A platform among obstacles, stepped every 50 ms.

    Args:
        robot: description; without a laser or bumpers there are no scans or bumper messages.
        obstacles: specs as in a scenario's ``[[world.obstacle]]``.
        start: X_WB at first, (3,) [m, m, rad]; odometry starts there as well.
        seed: of everything random; equal seeds give equal runs.
        imperfect: errors of drive and estimate.
        timeline: disturbances that act; of these laser, bumper and odometry know ``dropout``,
            ``delay``, ``noise`` and ``blinded``.

    Attributes:
        pose: true X_WB, (3,).
        velocity: true V_WB_B, (3,).
        clearance: smallest distance so far from the platform's edge to an obstacle [m].
        collided: whether it ever overlapped with one.
        travelled: length of the way so far [m].
    """

    def __init__(
        self,
        robot: Robot,
        obstacles: Iterable[Obstacle],
        start: Array | tuple[float, float, float],
        seed: int,
        imperfect: Imperfect = Imperfect(),
        timeline: Iterable[Timed] = (),
    ) -> None:
        streams = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(4)]
        self._platform, self._chassis = robot.platform, robot.chassis
        self._obstacles = Obstacles(obstacles)
        self._imperfect = imperfect
        self._timeline = list(timeline)
        self._lag = robot.platform.lag * (1.0 + imperfect.lag * streams[0].uniform(-1.0, 1.0))
        self._rng, self._noise = streams[0], streams[1]
        self._rough = np.array(imperfect.roughness) * self._rng.standard_normal(3)
        self._wheels = Wheels(imperfect.scale)
        self._laser, self._bumper = None, None
        if robot.laser is not None:
            self._laser = LaserSensor(
                robot.laser, self._obstacles, 0.0, imperfect.laser_noise, streams[2]
            )
        if robot.bumper is not None:
            radius = robot.chassis.radius
            self._bumper = BumperSensor(robot.bumper, radius, self._obstacles, 0.0, streams[3])
        self.pose: Array = np.array(start, dtype=float)
        self.velocity: Array = np.zeros(3)
        self.travelled = 0.0
        self._now: float | None = None
        self._scan: Scan | None = None
        self._touch: Bumper | None = None
        self._estimate = Estimate(
            t=0.0,
            pose=self.pose.copy(),
            velocity=np.zeros(3),
            acceleration=np.zeros(3),
            covariance=np.diag(
                np.square([*imperfect.pose_noise, *imperfect.velocity_noise]).astype(float)
            ),
            gyro_bias=0.0,
            accel_bias=np.zeros(2),
            odometry_innovation=np.zeros(3),
            odometry_nis=0.0,
            imu_innovation=np.zeros(3),
            imu_nis=0.0,
            odometry_age=0.0,
            imu_age=0.0,
            command_age=0.0,
            mode="driving",
        )
        self.clearance = self._obstacles.clearance(0.0, self.pose, self._chassis.radius)
        self._look_again = 0.0
        self.collided = self.clearance < 0.0

    def step(
        self, now: float, command: Array | tuple[float, float, float]
    ) -> tuple[Estimate, Scan | None, Bumper | None]:
        """Drive from the last call's ``now`` to this one's; the first call does not move.

        Args:
            now: robot time, 50 ms after the last call's [s].
            command: V_OB_B asked for since then, (3,) [m/s, m/s, rad/s]; what a differential
                drive is asked to do sideways it does not do.

        Returns:
            The estimate of ``now``, and the newest scan and bumper message that have arrived by
            then, None before the first and from a robot without the sensor.
        """
        wanted = [
            clamp(float(c), m) for c, m in zip(command, self._platform.speed_limit, strict=True)
        ]
        if self._chassis.drive == "differential":
            wanted[1] = 0.0
        if self._now is None:
            self._hear(now)
        else:
            for i in range(round((now - self._now) / DT)):
                self._move(wanted)
                self._hear(self._now + (i + 1) * DT)
        self._now = now
        return self._estimated(now), self._scan, self._touch

    def _move(self, wanted: list[float]) -> None:
        """One piece of the way: as ``sim/drive.py``, which steers the velocity in B."""
        keep = math.exp(-DT / self._imperfect.roughness_correlation)
        spread = math.sqrt(1.0 - keep * keep)
        drawn = self._rng.standard_normal(3)
        self._rough = keep * self._rough + spread * np.array(self._imperfect.roughness) * drawn
        limits = self._platform.acceleration_limit
        v = self.velocity.tolist()
        driving = max(map(abs, v)) > 1e-3
        rough = self._rough.tolist()
        if self._chassis.drive == "differential":
            rough[1] = 0.0
        for i in range(3):
            a = clamp((wanted[i] - v[i]) / self._lag, limits[i])
            v[i] += DT * (a + rough[i] if driving else a)
        heading = self.pose[2] + 0.5 * DT * v[2]
        c, s = math.cos(heading), math.sin(heading)
        moved = [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]]
        self.pose = self.pose + DT * np.array(moved)
        self.velocity = np.array(v)
        self.travelled += DT * math.hypot(v[0], v[1])

    def _hear(self, now: float) -> None:
        self._collide(now)
        effects: Effects = effects_at(now, self._timeline)
        if self._laser is not None:
            for scan in self._laser.step(now, self.pose, effects):
                self._scan = scan
        if self._bumper is not None:
            for touch in self._bumper.step(now, self.pose, effects):
                self._touch = touch

    def _collide(self, now: float) -> None:
        """Keep count of the clearance; where they overlap, the platform gives way."""
        if now < self._look_again or not len(self._obstacles):
            return
        radius = self._chassis.radius
        distance, toward = self._obstacles.at(now).nearest(self.pose[:2])
        gaps = distance - radius
        smallest = float(gaps.min())
        self.clearance = min(self.clearance, smallest)
        # nothing can come this near any sooner, so there is no need to look
        beyond = smallest - max(self.clearance, 0.0)
        self._look_again = now + max(beyond, 0.0) / (QUICKEST + self._obstacles.fastest)
        if smallest < 0.0:
            self.collided = True
            for gap, direction in zip(gaps.tolist(), toward, strict=True):
                if gap < 0.0:
                    self.pose[:2] += gap * direction
            self.velocity = np.zeros(3)

    def _estimated(self, now: float) -> Estimate:
        counted = self._wheels.roll(self.pose.copy())
        c, s = math.cos(counted[2]), math.sin(counted[2])
        vx, vy, w = self.velocity.tolist()
        velocity = np.array([c * vx - s * vy, s * vx + c * vy, w])
        noise = self._noise.standard_normal(6)
        self._estimate = replace(
            self._estimate,
            t=now,
            pose=counted + noise[:3] * self._imperfect.pose_noise,
            velocity=velocity + noise[3:] * self._imperfect.velocity_noise,
        )
        return self._estimate
