"""The simulated two-armed robot: commands in; joint states, sensors and truth out."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from services.messages import ArmCommand, ArmState, BaseCommand, Message, Truth
from sim.box_vision import BoxVision, Scene
from sim.brakes import Brakes
from sim.differential_drive import STANDS, DifferentialDrive
from sim.effects import Effects
from sim.rolling import Rolling
from sim.scenario import Scenario
from sim.sensors import ImuSensor, OdometrySensor
from sim.start import start_pose
from sim.timeline import Timeline
from sim.two_arm_physics import TwoArmPhysics

Array = NDArray[np.float64]

TRUTH_EVERY = 2
"""Steps between truth messages."""
HIDING = (
    ("left_link4", "left_link6", 0.045),
    ("left_link6", "left_palm", 0.05),
    ("right_link4", "right_link6", 0.045),
    ("right_link6", "right_palm", 0.05),
)
"""Forearms and hands that the camera cannot look through: from body to body, radius [m]."""


class TwoArmSimulator:
    """A two-armed robot in its world, stepped at the period of its description.

    Args:
        scenario: world, sensors and timeline of disturbances.
        seed: of everything random; equal seeds give bit-identical runs.

    Attributes:
        physics: robot and world.
        timeline: disturbances.
        brakes: of the motors.
        joints: of both arms.
        period: of a step [s].

    Raises:
        BadFile: another kind of robot, or none of that name.
        ValueError: the timeline pushes what is not there.
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        streams = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(7)]
        world, sensors = scenario.world, scenario.sensors
        start = start_pose(world, streams[0])
        self.physics = TwoArmPhysics(scenario.robot, world, start, streams[1])
        robot = sensors.overlay(self.physics.robot)
        drawn = self.physics.drawn
        self.period = robot.period
        self.joints = len(robot.arms.joints)
        drive = DifferentialDrive(
            robot,
            self.physics.drive_inertia(),
            drawn.lag,
            np.array(world.mismatch.roughness),
            world.mismatch.roughness_correlation,
            streams[2],
            self.period,
        )
        self._rolling = Rolling(drive, self.physics.set_wheel_friction, STANDS)
        self._odometry = OdometrySensor(robot, sensors, streams[3])
        self._imu = ImuSensor(robot, sensors, drawn.noise, streams[4], world.floor_tilt)
        self._vision: BoxVision | None = None
        if robot.vision is not None and sensors.vision.enabled and world.box is not None:
            self._vision = BoxVision(
                robot.vision, world.box.size, sensors.vision.dropout, drawn.noise, streams[5]
            )
        cell = robot.load_cell
        self._load_cell_noise = drawn.noise * np.array(
            ([cell.force_noise] * 3 + [cell.moment_noise] * 3) * 2
        )
        self._rng = streams[6]
        self.timeline = Timeline(scenario.disturbance, self.physics.bodies)
        self._resolution = robot.arms.encoder_resolution
        self._counts = self._encoders()
        self._tare: Array | None = None
        self.brakes = Brakes(self.physics.set_brakes)
        self._steps = 0

    def step(self, now: float, arm: ArmCommand | None, base: BaseCommand | None) -> list[Message]:
        """Measure the state at ``now`` [s], then advance by a period.

        Args:
            now: robot time [s].
            arm: newest torque command, None before the first.
            base: newest velocity command, None before the first.
        """
        effects = self.timeline.at(now)
        physics = self.physics
        pose, velocity, acceleration = physics.pose, physics.velocity, physics.acceleration
        out: list[Message] = [self._arm_state(now)]
        out += self._odometry.step(now, self.period, pose, effects)
        out += self._imu.step(now, pose, velocity, acceleration, effects)
        if self._vision is not None:
            out += self._vision.step(now, self._scene, effects)
        self._steps += 1
        if self._steps % TRUTH_EVERY == 0:
            out.append(self._truth(now, pose, velocity, acceleration, effects))
        silent = self.brakes.look(now, arm)
        torque = np.zeros(self.joints) if arm is None or silent else arm.tau
        drive = self._rolling.force(now, base, float(pose[2]), velocity, effects)
        physics.step(torque, drive, effects)
        return out

    def _arm_state(self, now: float) -> ArmState:
        counts = self._encoders()
        qd = (counts - self._counts) * (self._resolution / self.period)
        self._counts = counts
        if self._steps == 0:  # nothing has been transmitted yet
            wrench = np.zeros(12)
        else:
            wrench = self.physics.wrench()
            if self._tare is None:
                self._tare = wrench
            wrench = wrench - self._tare
        wrench = wrench + self._load_cell_noise * self._rng.standard_normal(12)
        return ArmState(
            t=now, q=counts * self._resolution, qd=qd, tau=self.physics.applied, wrench=wrench
        )

    def _truth(
        self, now: float, pose: Array, velocity: Array, acceleration: Array, effects: Effects
    ) -> Truth:
        forces = self.physics.hardest_forces()
        squeeze = min(math.hypot(*forces["left_palm"]), math.hypot(*forces["right_palm"]))
        return Truth(
            t=now,
            pose=pose,
            velocity=velocity,
            acceleration=acceleration,
            q=self.physics.q,
            qd=self.physics.qd,
            tip=np.zeros(3),
            force=squeeze,
            contact=squeeze > 0.0,
            disturbances=list(effects.names),
            bodies=self.physics.known(),
            forces=forces,
        )

    def _scene(self) -> Scene:
        at = self.physics.transform
        R_WB, p_WB = at("platform")
        R_WX, p_WX = at("box")
        return Scene(
            R_WB,
            p_WB,
            R_WX,
            p_WX,
            np.array([at(first)[1] for first, _, _ in HIDING]),
            np.array([at(second)[1] for _, second, _ in HIDING]),
            np.array([radius for _, _, radius in HIDING]),
        )

    def _encoders(self) -> Array:
        return np.rint(self.physics.q / self._resolution)
