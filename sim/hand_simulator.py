"""The simulated arm with a hand on a platform: commands in; states, sensors and truth out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deploy.robot import HandRobot, load_robot
from services.messages import (
    ArmCommand,
    ArmState,
    BaseCommand,
    HandCommand,
    HandState,
    Message,
    Truth,
)
from sim.brakes import Brakes
from sim.drive import HOLDING, Drive
from sim.effects import Effects
from sim.hand_world import HandMismatch, HandWorld, Setting, Top
from sim.robot_world import THICKNESS, listed
from sim.rolling import Rolling, on_platform
from sim.scenario import Scenario, World
from sim.sensors import ImuSensor, OdometrySensor
from sim.start import start_pose
from sim.timeline import Timeline

Array = NDArray[np.float64]

ARM_JOINTS, HAND_JOINTS = 7, 4
SLOW = 0.02
"""Wheels that are asked to stand hold below this speed, for a rough floor shakes what rolls."""
TRUTH_EVERY = 2
"""Steps between truth messages."""


class HandSimulator:
    """A robot with a hand in its world, stepped at the period of its description.

    Args:
        scenario: world, sensors and timeline of disturbances.
        seed: of everything random; equal seeds give bit-identical runs.

    Attributes:
        world: robot, table and bottle.
        timeline: disturbances.
        brakes: of the motors.
        period: of a step [s].
        joints: of the arm.

    Raises:
        BadFile: another kind of robot, or none of that name.
        ValueError: the timeline pushes what is not there.
    """

    joints = ARM_JOINTS

    def __init__(self, scenario: Scenario, seed: int) -> None:
        streams = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(6)]
        described = load_robot(scenario.robot, HandRobot)
        mismatch = scenario.world.mismatch
        self.world = HandWorld(scenario.robot, setting_of(scenario.world, streams[0]), streams[1])
        self.world.put(np.array([*described.arm.rest, 0.0, *[described.hand.open] * 3]))
        robot = scenario.sensors.overlay(described)
        drawn = streams[2]
        lag = robot.platform.lag * (1.0 + mismatch.lag * drawn.uniform(-1.0, 1.0))
        noise = float(drawn.uniform(1.0, max(1.0, mismatch.sensor_noise)))
        self.period = described.period
        self._substeps = round(self.period / self.world.setting.step)
        self._inertia = self.world.drive_inertia()
        drive = Drive(
            robot,
            self._inertia,
            lag,
            np.array(mismatch.roughness),
            mismatch.roughness_correlation,
            streams[3],
            self.period,
        )
        self._rolling = Rolling(drive, self.world.set_wheel_friction, HOLDING, SLOW)
        self._odometry = OdometrySensor(robot, scenario.sensors, streams[4])
        tilt = scenario.world.floor_tilt
        self._imu = ImuSensor(robot, scenario.sensors, noise, streams[5], tilt)
        self.timeline = Timeline(scenario.disturbance, self.world.bodies)
        self._acceleration = np.zeros(3)
        self._applied = np.zeros(ARM_JOINTS + HAND_JOINTS)
        self._touched: dict[str, Array] = {}
        self._peaks = {tip: np.zeros(3) for tip in described.hand.tips}
        self.brakes = Brakes(self.world.set_brakes)
        self._steps = 0

    def step(
        self,
        now: float,
        arm: ArmCommand | None,
        hand: HandCommand | None,
        base: BaseCommand | None,
    ) -> list[Message]:
        """Measure the state at ``now`` [s], then advance by a period.

        Args:
            now: robot time [s].
            arm, hand: newest torque commands, None before the first.
            base: newest velocity command, None before the first.
        """
        effects = self.timeline.at(now)
        world = self.world
        pose, velocity = world.pose, world.velocity
        out = self._states(now)
        out += self._odometry.step(now, self.period, pose, effects)
        out += self._imu.step(now, pose, velocity, self._acceleration, effects)
        self._steps += 1
        if self._steps % TRUTH_EVERY == 0:
            out.append(self._truth(now, pose, velocity, effects))
        torque = np.zeros(ARM_JOINTS + HAND_JOINTS)
        if not self.brakes.look(now, arm, hand):
            assert arm is not None and hand is not None
            torque = np.concatenate([arm.tau, hand.tau])
        self._applied = torque
        heading = float(pose[2])
        drive = self._rolling.force(now, base, heading, velocity, effects)
        force = on_platform(drive, heading, effects, lambda: self._inertia)
        pressed = {tip: np.zeros(3) for tip in self._peaks}
        for _ in range(self._substeps):
            world.step(torque, force, effects.pushes, effects.vertical)
            self._touched = world.contacts()
            for name in pressed.keys() & self._touched.keys():
                pressed[name] += self._touched[name][:, 3:].sum(axis=0) / self._substeps
        for name, mean in pressed.items():  # rigid contacts: over less time they mean nothing
            if mean @ mean > self._peaks[name] @ self._peaks[name]:
                self._peaks[name] = mean
        self._acceleration = (world.velocity - velocity) / self.period
        return out

    def _states(self, now: float) -> list[Message]:
        world = self.world
        q, qd, tau = world.q, world.qd, self._applied
        cells = world.cells(self._substeps) if self._steps else np.zeros((3, 6))
        struck = any(not body.startswith("tip") for body in self._touched)
        n = ARM_JOINTS
        return [
            ArmState(t=now, q=q[:n], qd=qd[:n], tau=tau[:n], wrench=np.zeros(0)),
            HandState(t=now, q=q[n:], qd=qd[n:], tau=tau[n:], cells=cells, struck=struck),
        ]

    def _truth(self, now: float, pose: Array, velocity: Array, effects: Effects) -> Truth:
        world = self.world
        forces = {name: peak.tolist() for name, peak in self._peaks.items()}
        hardest = max(float(np.linalg.norm(peak)) for peak in self._peaks.values())
        for name in self._peaks:
            self._peaks[name] = np.zeros(3)
        bodies = {"palm": listed(*world.palm())}
        if world.thing is not None:
            bodies["bottle"] = listed(*world.object())
        return Truth(
            t=now,
            pose=pose,
            velocity=velocity,
            acceleration=self._acceleration,
            q=world.q,
            qd=world.qd,
            tip=np.zeros(3),
            force=hardest,
            contact=hardest > 0.0,
            disturbances=list(effects.names),
            bodies=bodies,
            forces=forces,
        )


def setting_of(world: World, rng: np.random.Generator) -> Setting:
    """The world of a scenario; where bottle and platform stand is drawn."""
    table, bottle = world.table, world.bottle
    top = Top((table.x, table.y, table.height), (*table.size, THICKNESS), table.yaw)
    mismatch = HandMismatch(inertia=world.mismatch.inertia, friction=world.mismatch.friction)
    yaw = float(rng.uniform(-np.pi, np.pi))
    off = rng.uniform(-1.0, 1.0, 2)
    start = start_pose(world, rng)
    if bottle is None:
        return Setting(None, mismatch=mismatch, table=top, start=start)
    x, y = (np.array([bottle.x, bottle.y]) + bottle.scatter * off).tolist()
    return Setting(
        bottle.thing,
        yaw=yaw,
        fixed=False,
        friction=bottle.friction,
        mass=bottle.mass,
        mismatch=mismatch,
        table=top,
        place=(x, y),
        start=start,
    )
