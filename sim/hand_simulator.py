"""The simulated arm with a hand on a platform: commands in; states, sensors and truth out."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

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
from sim.disturbance import Timed, refuse_absent
from sim.drive import HOLDING, WATCHDOG, Drive
from sim.effects import Effects, effects_at
from sim.hand_world import HandMismatch, HandWorld, Setting, Top
from sim.scenario import Scenario, World
from sim.sensors import ImuSensor, OdometrySensor
from sim.simulator import BRAKE, BRAKE_AFTER, ROLLING
from sim.two_arm_simulator import start_pose

Array = NDArray[np.float64]

ARM_JOINTS, HAND_JOINTS = 7, 4
THICKNESS = 0.04
"""Of the table's top [m]."""
SLOW = 0.02
"""Wheels that are asked to stand hold the platform below this speed [m/s, rad/s]."""
TRUTH_EVERY = 2
"""Steps between truth messages."""


class HandSimulator:
    """A robot with a hand in its world, stepped at the period of its description.

    Args:
        scenario: world, sensors and timeline of disturbances.
        seed: of everything random; equal seeds give bit-identical runs.

    Attributes:
        world: robot, table and bottle.
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
        self._drive = Drive(
            robot,
            self._inertia,
            lag,
            np.array(mismatch.roughness),
            mismatch.roughness_correlation,
            streams[3],
            self.period,
        )
        self._odometry = OdometrySensor(robot, scenario.sensors, streams[4])
        tilt = scenario.world.floor_tilt
        self._imu = ImuSensor(robot, scenario.sensors, noise, streams[5], tilt)
        self._timeline: list[Timed] = []
        for disturbance in scenario.disturbance:
            self.refuse(disturbance)
            self._timeline.append(disturbance)
        self._acceleration = np.zeros(3)
        self._applied = np.zeros(ARM_JOINTS + HAND_JOINTS)
        self._peaks = {tip: np.zeros(3) for tip in described.hand.tips}
        self._standing = False
        self._steps = 0
        self._set_brakes(True)

    def refuse(self, disturbance: Timed) -> None:
        """Raise ValueError for a push on what is not there."""
        refuse_absent(disturbance, self.world.bodies)

    def disturb(self, disturbance: Timed, now: float) -> Timed:
        """Add a disturbance to the timeline."""
        self._timeline = [d for d in self._timeline if d.end > now] + [disturbance]
        return disturbance

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
        effects = effects_at(now, self._timeline)
        world = self.world
        pose, velocity = world.pose, world.velocity
        out = self._states(now)
        out += self._odometry.step(now, self.period, pose, effects)
        out += self._imu.step(now, pose, velocity, self._acceleration, effects)
        self._steps += 1
        if self._steps % TRUTH_EVERY == 0:
            out.append(self._truth(now, pose, velocity, effects))
        torque = np.zeros(ARM_JOINTS + HAND_JOINTS)
        silent = arm is None or hand is None or now - min(arm.t, hand.t) > BRAKE_AFTER
        if not silent:
            assert arm is not None and hand is not None
            torque = np.concatenate([arm.tau, hand.tau])
        if silent != self._braked:
            self._set_brakes(silent)
        self._applied = torque
        drive = self._driven(now, base, pose, velocity, effects)
        for _ in range(self._substeps):
            world.step(torque, drive, effects.pushes, effects.vertical)
        self._acceleration = (world.velocity - velocity) / self.period
        return out

    def _driven(
        self,
        now: float,
        base: BaseCommand | None,
        pose: Array,
        velocity: Array,
        effects: Effects,
    ) -> Array:
        """Force of the drive on the platform in W, shape (3,) [N, N, N m]."""
        # what the wheels see
        rolling = velocity - np.array([*effects.slip, 0.0]) if effects.slips else velocity
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x, y, w = rolling.tolist()
        force = self._drive.force(now, base, (c * x + s * y, c * y - s * x, w))
        asked = base is not None and now - base.t <= WATCHDOG and bool(base.velocity.any())
        # a rough floor shakes what rolls; wheels that are asked to stand hold at last
        slow = not asked and float(np.abs(rolling).max()) < SLOW
        standing = slow and not (effects.slips and effects.slip.any())
        if standing != self._standing:
            self._standing = standing
            self.world.set_wheel_friction(HOLDING if standing else ROLLING)
        out = np.array([c * force[0] - s * force[1], s * force[0] + c * force[1], force[2]])
        if effects.yaw:
            out[2] += effects.yaw * self._inertia[2]
        if effects.slips:
            out[:2] += self._inertia[:2] * effects.slip_acceleration
        return out

    def _states(self, now: float) -> list[Message]:
        world = self.world
        q, qd, tau = world.q, world.qd, self._applied
        touched = world.contacts() if self._steps else {}
        for name, peak in self._peaks.items():
            if name in touched:
                force = touched[name][:, 3:].sum(axis=0)
                if force @ force > peak @ peak:
                    self._peaks[name] = force
        cells = world.cells(self._substeps) if self._steps else np.zeros((3, 6))
        struck = any(not body.startswith("tip") for body in touched)
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
        bodies = {"palm": _listed(*world.palm())}
        if world.thing is not None:
            bodies["bottle"] = _listed(*world.object())
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

    def _set_brakes(self, on: bool) -> None:
        self._braked = on
        self.world.set_brakes(BRAKE if on else None)


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


def _listed(R: Array, p: Array) -> list[float]:
    """X_WX as x, y, z [m], then w, x, y, z of the unit quaternion."""
    quaternion = Rotation.from_matrix(R).as_quat(scalar_first=True)
    return [*p.tolist(), *quaternion.tolist()]
