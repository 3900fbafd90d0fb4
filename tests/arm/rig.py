"""A simulated robot and its executive in one loop, with the lockstep runner's latency."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from arm.executive import Executive
from arm.hds import Program, check_text, load
from arm.nodes import REGISTRY
from deploy.task import BoardPose, Task
from services.messages import (
    ArmCommand,
    ArmState,
    ArmStatus,
    Array,
    BaseCommand,
    Estimate,
    Message,
)
from sim.scenario import Board, Mismatch, Scenario, World
from sim.simulator import Simulator

TICK = 0.001
AHEAD = 0.6
"""The pen's tip at the start, ahead of the platform's centre [m]."""
EXACT = Mismatch(
    inertia=0.0,
    friction=0.0,
    lag=0.0,
    payload=0.0,
    sensor_noise=1.0,
    roughness=(0.0, 0.0, 0.0),
)
"""The simulated robot is the described one."""


def world_at(board: float, believed: float | None = None, **fields: Any) -> Scenario:
    """A scenario with the board ``board`` [m] ahead of the platform's centre."""
    return Scenario(
        world=World(board=Board(x=board), **fields),
        task=Task(board=BoardPose(x=board if believed is None else believed)),
    )


def estimate_at(t: float, pose: Array, velocity: Array, **fields: Any) -> Estimate:
    """An estimate of the platform that is valid unless told otherwise."""
    return Estimate(
        t=t,
        pose=pose,
        velocity=velocity,
        acceleration=np.zeros(3),
        covariance=np.eye(6) * 1e-8,
        gyro_bias=0.0,
        accel_bias=np.zeros(2),
        odometry_innovation=np.zeros(3),
        odometry_nis=0.0,
        imu_innovation=np.zeros(3),
        imu_nis=0.0,
        odometry_age=0.0,
        imu_age=0.0,
        command_age=0.0,
        **fields,
    )


class Rig:
    """Simulator and executive; every message takes a tick; the estimate is the truth.

    Attributes:
        sense: what becomes of a true estimate on its way (None for silence).
        deaf: the arm is not stepped: its process hangs.
        statuses: every status said.
    """

    def __init__(self, scenario: Scenario, seed: int = 1) -> None:
        self.sim = Simulator(scenario, seed)
        self.arm = Executive(scenario.robot, scenario.task.board)
        self.sense: Callable[[Estimate], Estimate | None] = lambda estimate: estimate
        self.alter: Callable[[ArmState], ArmState] = lambda state: state
        self.deaf = False
        self.ticks = 0
        self.statuses: list[ArmStatus] = []
        self.t: list[float] = []
        self.tip: list[Array] = []
        self.force: list[float] = []
        self.desired: list[Array] = []
        self.rate: list[Array] = []
        self.base: BaseCommand | None = None
        self.command: ArmCommand | None = None
        self._state: ArmState | None = None
        self._estimate: Estimate | None = None

    @property
    def now(self) -> float:
        """Robot time of the next tick [s]."""
        return self.ticks * TICK

    @property
    def status(self) -> ArmStatus:
        """The newest status."""
        return self.statuses[-1]

    def step(self) -> list[Message]:
        """One tick; returns what the robot said."""
        physics = self.sim.physics
        pose, velocity = physics.pose, physics.velocity
        messages = self.sim.step(self.now, self.command, self.base)
        if self._state is not None and not self.deaf:
            estimate = None if self._estimate is None else self.sense(self._estimate)
            self.command, status = self.arm.step(self.alter(self._state), estimate)
            if status is not None:
                self.statuses.append(status)
        self._state = next(m for m in messages if isinstance(m, ArmState))
        self._estimate = estimate_at(self.now, pose, velocity)
        self.t.append(self.now)
        self.tip.append(physics.tip())
        self.force.append(physics.contact_force())
        self.desired.append(self.arm._desired.copy())
        self.rate.append(self.arm._reference.qd.copy())
        self.ticks += 1
        return messages

    def run(self, seconds: float) -> Rig:
        """Run for a time."""
        for _ in range(round(seconds / TICK)):
            self.step()
        return self

    def until(self, condition: Callable[[], bool], limit: float = 10.0) -> Rig:
        """Run until ``condition`` holds.

        Raises:
            AssertionError: it did not within ``limit`` [s]; says what the arm was doing.
        """
        for _ in range(round(limit / TICK)):
            if condition():
                return self
            self.step()
        status = self.status
        raise AssertionError(
            f"still {status.state} in {status.node!r} after {limit} s: {status.reason}"
        )

    def until_state(self, state: str, limit: float = 10.0) -> Rig:
        """Run until the executive's state is ``state``."""
        return self.until(lambda: self.arm.state == state, limit)

    def until_drawn(self, length: float, limit: float = 5.0) -> Rig:
        """Run until so much of a stroke is drawn [m]."""

        def drawn() -> bool:
            node = self.arm._node
            return getattr(node, "_drawn", 0.0) >= length

        return self.until(drawn, limit)


def program(text: str) -> Program:
    """A program from its text."""
    made, findings = check_text(text, "test.hds", REGISTRY)
    assert made is not None, findings
    return made


def from_file(path: Path) -> Program:
    """A program from its file."""
    return load(path, REGISTRY)
