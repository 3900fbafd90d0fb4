"""The simulated robot: commands in; joint states, sensors and truth out. It knows no bus."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from services.messages import (
    ArmCommand,
    ArmState,
    BaseCommand,
    Message,
    Truth,
)
from sim.brakes import Brakes
from sim.differential_drive import DifferentialDrive
from sim.draws import normal_rows
from sim.drive import HOLDING, Drive
from sim.physics import DT, Physics
from sim.rolling import Rolling
from sim.scenario import Scenario
from sim.sensors import ImuSensor, OdometrySensor
from sim.surroundings import Surroundings
from sim.timeline import Timeline

Array = NDArray[np.float64]

TRUTH_EVERY = 5
"""Ticks between truth messages."""


class Simulator:
    """A robot in its world, stepped at 1 ms.

    Args:
        scenario: world, sensors and timeline of disturbances.
        seed: of everything random; equal seeds give bit-identical runs.

    Attributes:
        physics: robot and world.
        timeline: disturbances.
        brakes: of the motors.
        joints: of the arm.

    Raises:
        BadFile: another kind of robot, or none of that name.
        ValueError: the timeline pushes what is not there.
    """

    period = DT

    def __init__(self, scenario: Scenario, seed: int) -> None:
        streams = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(8)]
        self.physics = Physics(scenario.robot, scenario.world, streams[0])
        robot = scenario.sensors.overlay(self.physics.robot)
        drawn = self.physics.drawn
        mismatch = scenario.world.mismatch
        kind = DifferentialDrive if robot.chassis.drive == "differential" else Drive
        drive = kind(
            robot,
            self.physics.drive_inertia(),
            drawn.lag,
            np.array(mismatch.roughness),
            mismatch.roughness_correlation,
            streams[1],
            DT,
        )
        self._rolling = Rolling(drive, self.physics.set_wheel_friction, HOLDING)
        self._odometry = OdometrySensor(robot, scenario.sensors, streams[2])
        tilt = scenario.world.floor_tilt
        self._imu = ImuSensor(robot, scenario.sensors, drawn.noise, streams[3], tilt)
        self._surroundings = Surroundings(robot, scenario, drawn.noise, streams[5:])
        self._mass = float(self.physics.drive_inertia()[0])
        noise = [robot.load_cell.force_noise] * 3 + [robot.load_cell.moment_noise] * 3
        self._load_cell_noise = normal_rows(streams[4], drawn.noise * np.array(noise))
        self.timeline = Timeline(scenario.disturbance, self.physics.bodies)
        self.joints = len(robot.arm.joints)
        self._no_torque = np.zeros(self.joints)
        self._resolution = robot.arm.encoder_resolution
        self._count_rate = self._resolution / DT
        self._counts = self._encoders()
        self._tare: Array | None = None
        self.brakes = Brakes(self.physics.set_brakes)
        self._ticks = 0
        self._force = 0.0
        self._recent: list[list[float]] = []

    def step(self, now: float, arm: ArmCommand | None, base: BaseCommand | None) -> list[Message]:
        """Measure the state at ``now`` [s], then advance to ``now`` + 1 ms.

        Args:
            now: robot time [s].
            arm: newest torque command, None before the first.
            base: newest velocity command, None before the first.
        """
        effects = self.timeline.at(now)
        physics = self.physics
        pose, velocity, acceleration = physics.pose, physics.velocity, physics.acceleration
        out: list[Message] = [self._arm_state(now)]
        out += self._odometry.step(now, DT, pose, effects)
        out += self._imu.step(now, pose, velocity, acceleration, effects)
        out += self._surroundings.step(now, pose, effects)
        tip = physics.tip()
        self._recent.append([*tip.tolist(), self._force])
        if len(self._recent) == TRUTH_EVERY:
            out.append(
                Truth(
                    t=now,
                    pose=pose,
                    velocity=velocity,
                    acceleration=acceleration,
                    q=physics.q,
                    qd=physics.qd,
                    tip=tip,
                    force=self._force,
                    contact=self._force > 0.0,
                    recent=np.array(self._recent),
                    disturbances=list(effects.names),
                    clearance=self._surroundings.clearance(now, pose),
                )
            )
            self._recent.clear()
        silent = self.brakes.look(now, arm)
        torque = self._no_torque if arm is None or silent else arm.tau
        drive = self._rolling.force(now, base, float(pose[2]), velocity, effects)
        push = self._surroundings.push(now, self._mass, pose, velocity)
        if push is not None:
            drive = [f + p for f, p in zip(drive, push.tolist(), strict=True)]
        physics.step(torque, drive, effects)
        self._force = physics.contact_force()
        self._ticks += 1
        return out

    def _arm_state(self, now: float) -> ArmState:
        counts = self._encoders()
        qd = (counts - self._counts) * self._count_rate
        self._counts = counts
        wrench = self.physics.wrench()
        if self._tare is None and self._ticks >= 1:
            self._tare = wrench
        wrench = wrench - self._tare if self._tare is not None else np.zeros(6)
        wrench += next(self._load_cell_noise)
        q = counts * self._resolution
        return ArmState(t=now, q=q, qd=qd, tau=self.physics.applied, wrench=wrench)

    def _encoders(self) -> Array:
        return np.rint(self.physics.q / self._resolution)
