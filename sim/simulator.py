"""The simulated robot: commands in; joint states, sensors and truth out. It knows no bus."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from services.messages import (
    ArmCommand,
    ArmState,
    BaseCommand,
    Message,
    Truth,
)
from sim.differential_drive import DifferentialDrive
from sim.disturbance import Timed, refuse_absent
from sim.draws import normal_rows
from sim.drive import HOLDING, Drive
from sim.effects import effects_at
from sim.physics import DT, Physics
from sim.scenario import Scenario
from sim.sensors import ImuSensor, OdometrySensor
from sim.surroundings import Surroundings

Array = NDArray[np.float64]

BRAKE_AFTER = 0.045
"""The motors brake when the newest torque command is older than this [s]."""
BRAKE = 300.0
"""Coulomb friction of an engaged brake [N m]."""
ROLLING = (0.0, 0.0, 0.0)
"""Friction the drive of a moving platform does not make up for [N, N, N m]."""
TRUTH_EVERY = 5
"""Ticks between truth messages."""


class Simulator:
    """A robot in its world, stepped at 1 ms.

    Args:
        scenario: world, sensors and timeline of disturbances.
        seed: of everything random; equal seeds give bit-identical runs.

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
        self._drive = kind(
            robot,
            self.physics.drive_inertia(),
            drawn.lag,
            np.array(mismatch.roughness),
            mismatch.roughness_correlation,
            streams[1],
            DT,
        )
        self._odometry = OdometrySensor(robot, scenario.sensors, streams[2])
        tilt = scenario.world.floor_tilt
        self._imu = ImuSensor(robot, scenario.sensors, drawn.noise, streams[3], tilt)
        self._surroundings = Surroundings(robot, scenario, drawn.noise, streams[5:])
        self._mass = float(self.physics.drive_inertia()[0])
        noise = [robot.load_cell.force_noise] * 3 + [robot.load_cell.moment_noise] * 3
        self._load_cell_noise = normal_rows(streams[4], drawn.noise * np.array(noise))
        self._timeline: list[Timed] = []
        for disturbance in scenario.disturbance:
            self.refuse(disturbance)
            self._timeline.append(disturbance)
        self.joints = len(robot.arm.joints)
        self._no_torque = np.zeros(self.joints)
        self._resolution = robot.arm.encoder_resolution
        self._count_rate = self._resolution / DT
        self._counts = self._encoders()
        self._tare: Array | None = None
        self._braked = True
        self._standing = False
        self._ticks = 0
        self._force = 0.0
        self._recent: list[list[float]] = []
        self._set_brakes(True)

    @property
    def braked(self) -> bool:
        """Whether the motors brake because no command is young enough."""
        return self._braked

    def refuse(self, disturbance: Timed) -> None:
        """Raise ValueError for a push on what is not there."""
        refuse_absent(disturbance, self.physics.bodies)

    def disturb(self, disturbance: Timed, now: float) -> Timed:
        """Add a disturbance to the timeline."""
        self._timeline = [d for d in self._timeline if d.end > now] + [disturbance]
        return disturbance

    def step(self, now: float, arm: ArmCommand | None, base: BaseCommand | None) -> list[Message]:
        """Measure the state at ``now`` [s], then advance to ``now`` + 1 ms.

        Args:
            now: robot time [s].
            arm: newest torque command, None before the first.
            base: newest velocity command, None before the first.
        """
        effects = effects_at(now, self._timeline)
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
        silent = arm is None or now - arm.t > BRAKE_AFTER
        if silent != self._braked:
            self._set_brakes(silent)
        torque = self._no_torque if arm is None or silent else arm.tau
        # what the wheels see
        rolling = velocity - np.array([*effects.slip, 0.0]) if effects.slips else velocity
        drive = self._drive.force(now, base, _in_body(float(pose[2]), rolling.tolist()))
        standing = self._drive.standing and not (effects.slips and effects.slip.any())
        if standing != self._standing:
            self._standing = standing
            physics.set_wheel_friction(HOLDING if self._standing else ROLLING)
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

    def _set_brakes(self, on: bool) -> None:
        self._braked = on
        self.physics.set_friction(BRAKE + self.physics.drawn.coulomb if on else None)


def _in_body(heading: float, velocity: list[float]) -> tuple[float, float, float]:
    c, s = math.cos(heading), math.sin(heading)
    vx, vy, w = velocity
    return c * vx + s * vy, c * vy - s * vx, w
