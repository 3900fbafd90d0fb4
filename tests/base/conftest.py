"""A drive that follows velocity commands as the robot's description says, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from base.planar import rotate
from base.platform import PERIOD, Platform
from deploy.robot import Robot, load_robot
from services.messages import Array, BaseStatus, Estimate

TICK = 0.001


@dataclass
class Run:
    """What happened, one row a millisecond; commands one row a step."""

    t: list[float] = field(default_factory=list)
    pose: list[Array] = field(default_factory=list)
    velocity: list[Array] = field(default_factory=list)
    command: list[Array] = field(default_factory=list)
    status: list[BaseStatus] = field(default_factory=list)

    @property
    def poses(self) -> Array:
        """(n, 3)"""
        return np.array(self.pose)

    @property
    def commands(self) -> Array:
        """(n, 3)"""
        return np.array(self.command)


class Plant:
    """First-order lag in the body frame; commands arrive a tick late; the estimate is the truth."""

    def __init__(self, robot: Robot, lag_factor: float = 1.0) -> None:
        self.lag = robot.platform.lag * lag_factor
        self.pose, self.body, self.command = np.zeros(3), np.zeros(3), np.zeros(3)
        self.tick = 0

    @property
    def now(self) -> float:
        """Robot time [s]."""
        return self.tick * TICK

    def estimate(self, t: float, valid: bool = True) -> Estimate:
        """The truth as the observer's message."""
        zero = np.zeros(3)
        return Estimate(
            t=t,
            pose=self.pose.copy(),
            velocity=rotate(self.pose[2], self.body),
            acceleration=zero,
            covariance=np.eye(6),
            gyro_bias=0.0,
            accel_bias=np.zeros(2),
            odometry_innovation=zero,
            imu_innovation=zero,
            odometry_nis=0.0,
            imu_nis=0.0,
            odometry_age=0.0,
            imu_age=0.0,
            command_age=0.0,
            valid=valid,
            reason="" if valid else "covariance",
        )

    def run(
        self,
        platform: Platform,
        duration: float,
        see: Callable[[float, Estimate], Estimate | None] = lambda now, estimate: estimate,
    ) -> Run:
        """Go on for ``duration`` [s]; ``see`` turns the true estimate into what is heard."""
        out = Run()
        every = round(PERIOD / TICK)
        for _ in range(round(duration / TICK)):
            if self.tick % every == 0:
                heard = see(self.now, self.estimate(self.now))
                command, status = platform.step(self.now, heard)
                self.command = command.velocity
                out.command.append(command.velocity)
                out.status.append(status)
            self.body = self.body + (self.command - self.body) * TICK / self.lag
            self.pose = self.pose + rotate(self.pose[2], self.body) * TICK
            self.tick += 1
            out.t.append(self.now)
            out.pose.append(self.pose.copy())
            out.velocity.append(self.body.copy())
        return out


@pytest.fixture(scope="session")
def robot() -> Robot:
    """The described robot."""
    return load_robot("xr4000_puma560")


@pytest.fixture
def plant(robot: Robot) -> Plant:
    """A drive exactly as described, at the origin."""
    return Plant(robot)


@pytest.fixture
def late_plant(robot: Robot) -> Plant:
    """A drive whose lag is 10 % more than described."""
    return Plant(robot, lag_factor=1.1)
