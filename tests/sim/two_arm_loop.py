"""Runs the two-armed simulator alone; its arms hold a posture by a law of a few lines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from deploy.skeleton import BOTH, load_two_arm_skeleton
from services.messages import ArmCommand, ArmState, Array, BaseCommand, Message
from sim.disturbance import Timed, disturbance_from
from sim.scenario import Box, Mismatch, Scenario, World
from sim.two_arm_simulator import TwoArmSimulator

ROBOT = "rmp_two_arms"
EXACT = Mismatch(
    inertia=0.0,
    friction=0.0,
    lag=0.0,
    payload=0.0,
    sensor_noise=1.0,
    roughness=(0.0, 0.0, 0.0),
)


def scenario(*disturbances: dict[str, Any], exact: bool = True, **world: Any) -> Scenario:
    """A robot 2 m in front of a box on a table."""
    world.setdefault("box", Box())
    world.setdefault("platform_start", (-2.0, 0.0, 0.0))
    if exact:
        world["mismatch"] = EXACT
    made: list[Timed] = [
        disturbance_from(d["kind"], {k: v for k, v in d.items() if k != "kind"}, 0.0)
        for d in disturbances
    ]
    return Scenario(robot=ROBOT, world=World(**world), disturbance=tuple(made))


class Holder:
    """Keeps a posture: gravity, and a spring and damper scaled by the mass matrix."""

    def __init__(self, target: Array | None = None) -> None:
        self._robot, self._skeleton = load_two_arm_skeleton(ROBOT)
        self.target = np.array(self._robot.arms.rest) if target is None else target

    def __call__(self, state: ArmState) -> ArmCommand:
        q, qd = np.zeros(17), np.zeros(17)
        q[BOTH], qd[BOTH] = state.q, state.qd
        self._skeleton.setPositions(q)
        self._skeleton.setVelocities(qd)
        wanted = np.zeros(17)
        wanted[BOTH] = 400.0 * (self.target - state.q) - 40.0 * state.qd
        tau = self._skeleton.getMassMatrix() @ wanted + self._skeleton.getGravityForces()
        return ArmCommand(t=state.t, tau=tau[BOTH])


@dataclass
class Recording:
    """What a robot said and did; poses at every step."""

    simulator: TwoArmSimulator
    messages: list[tuple[float, Message]] = field(default_factory=list)
    poses: list[Array] = field(default_factory=list)

    def of(self, kind: type[Any]) -> list[Any]:
        """Messages of a class."""
        return [m for _, m in self.messages if type(m) is kind]

    @property
    def pose(self) -> Array:
        """True pose of the platform, shape (n, 3)."""
        return np.array(self.poses)


def run(
    made: Scenario,
    seconds: float,
    base: Callable[[float], tuple[float, float, float] | None] = lambda t: (0.0, 0.0, 0.0),
    arms: Callable[[ArmState], ArmCommand | None] | None = None,
    seed: int = 1,
) -> Recording:
    """Run with a velocity command every 48 ms; torques act a period after the state they answer."""
    arms = arms if arms is not None else Holder()
    simulator = TwoArmSimulator(made, seed)
    out = Recording(simulator)
    driven: BaseCommand | None = None
    torque: ArmCommand | None = None
    for number in range(round(seconds / simulator.period)):
        now = number * simulator.period
        if number % 12 == 0:
            velocity = base(now)
            if velocity is not None:
                driven = BaseCommand(t=now, velocity=np.array(velocity))
        out.poses.append(simulator.physics.pose)
        said = simulator.step(now, torque, driven)
        out.messages += [(now, m) for m in said]
        torque = arms(said[0]) or torque  # type: ignore[arg-type]
    return out


LEVEL = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
"""R_BP of palms that are upright with the fingertips ahead."""


class Squeezer:
    """Palms on springs: ahead past the box, inwards against it, and up.

    Args:
        centre: p_BX of the box, shape (3,) [m].
        half: of its width [m].
        force: to squeeze with [N].
        lift: height to lift to, from ``t`` = 3.5 s on [m].
    """

    STIFFNESS = 800.0

    def __init__(self, centre: Array, half: float, force: float, lift: float) -> None:
        self._robot, self._skeleton = load_two_arm_skeleton(ROBOT)
        self._palms = [self._skeleton.getBodyNode(link) for link in self._robot.palms.links]
        self._centre, self._half, self._force, self._lift = centre, half, force, lift

    def __call__(self, state: ArmState) -> ArmCommand:
        q, qd = np.zeros(17), np.zeros(17)
        q[BOTH], qd[BOTH] = state.q, state.qd
        self._skeleton.setPositions(q)
        self._skeleton.setVelocities(qd)
        M = self._skeleton.getMassMatrix()
        tau = self._skeleton.getGravityForces() - 8.0 * M @ qd
        phases = ((0.0, 1.5), (1.5, 1.5), (3.5, 1.0))  # begin, duration [s]
        ahead, inward, up = (float(np.clip((state.t - t) / d, 0, 1)) for t, d in phases)
        deep = self._force / self.STIFFNESS
        for palm, side in zip(self._palms, (1.0, -1.0), strict=True):
            at = palm.getWorldTransform()
            J = self._skeleton.getJacobian(palm, [0.0, 0.0, 0.0])
            R, p = np.asarray(at.rotation()), np.asarray(at.translation()).reshape(3)
            goal = self._centre + [0.0, side * (self._half + 0.01 - deep), self._lift * up]
            goal[0] = 0.34 + ahead * (goal[0] - 0.34)
            goal[1] = side * 0.27 + inward * (goal[1] - side * 0.27)
            force = self.STIFFNESS * (goal - p)
            moment = 20.0 * 0.5 * sum(np.cross(R[:, i], LEVEL[:, i]) for i in range(3))
            world = np.vstack([R @ J[:3], R @ J[3:]])
            v = world @ qd
            tau += world.T @ np.concatenate([moment - 1.0 * v[:3], force - 40.0 * v[3:]])
        return ArmCommand(t=state.t, tau=tau[BOTH])
