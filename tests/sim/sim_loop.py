"""Runs a simulator alone, with commands that are functions of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from services.messages import ArmCommand, ArmState, Array, BaseCommand, Imu, Odometry, Truth
from sim.scenario import Board, Mismatch, Scenario, World
from sim.simulator import Simulator

TICK = 0.001
EXACT = Mismatch(
    inertia=0.0,
    friction=0.0,
    lag=0.0,
    payload=0.0,
    sensor_noise=1.0,
    roughness=(0.0, 0.0, 0.0),
)
"""The simulated robot is the described one."""
SILENT_SENSORS = {
    "imu": {"gyro_noise": 0.0, "gyro_bias": 0.0, "accel_noise": 0.0, "accel_bias": 0.0},
    "load_cell": {"force_noise": 0.0, "moment_noise": 0.0},
}
"""Sensors without noise or bias."""


def scenario(
    *disturbances: dict[str, Any],
    sensors: dict[str, Any] | None = None,
    exact: bool = True,
    **world: Any,
) -> Scenario:
    """A scenario with a timeline, and its board out of the way."""
    world.setdefault("board", Board(x=9.0))
    if exact:
        world["mismatch"] = EXACT
    return Scenario(
        world=World(**world),
        sensors=SILENT_SENSORS if sensors is None else sensors,
        disturbance=disturbances,
    )


@dataclass
class Recording:
    """What a robot said and did."""

    simulator: Simulator
    odometry: list[tuple[float, Odometry]] = field(default_factory=list)
    """With the time of arrival."""
    imu: list[tuple[float, Imu]] = field(default_factory=list)
    arm: list[ArmState] = field(default_factory=list)
    truth: list[Truth] = field(default_factory=list)
    poses: list[Array] = field(default_factory=list)
    velocities: list[Array] = field(default_factory=list)

    @property
    def pose(self) -> Array:
        """True pose at every tick, shape (n, 3)."""
        return np.array(self.poses)

    @property
    def velocity(self) -> Array:
        """True velocity at every tick, shape (n, 3)."""
        return np.array(self.velocities)


def drive(
    made: Scenario,
    seconds: float,
    command: Callable[[float], tuple[float, float, float] | None] | None = None,
    torque: Callable[[float], Array | None] | None = None,
    seed: int = 1,
) -> Recording:
    """Run with a velocity command every 50 ms and a torque command every tick, None for silence."""
    simulator = Simulator(made, seed)
    out = Recording(simulator)
    base: BaseCommand | None = None
    arm: ArmCommand | None = None
    for tick in range(round(seconds / TICK)):
        now = tick * TICK
        if command is not None and tick % 50 == 0:
            velocity = command(now)
            if velocity is not None:
                base = BaseCommand(t=now, velocity=np.array(velocity))
        if torque is not None:
            tau = torque(now)
            if tau is not None:
                arm = ArmCommand(t=now, tau=tau)
        out.poses.append(simulator.physics.pose)
        out.velocities.append(simulator.physics.velocity)
        for message in simulator.step(now, arm, base):
            if isinstance(message, Odometry):
                out.odometry.append((now, message))
            elif isinstance(message, Imu):
                out.imu.append((now, message))
            elif isinstance(message, Truth):
                out.truth.append(message)
            elif isinstance(message, ArmState):
                out.arm.append(message)
    return out
