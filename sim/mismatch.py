"""Makes the simulated robot differ from its description, as every real one does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import dartpy as dart
import numpy as np
from numpy.typing import NDArray

from deploy.robot import Robot, TwoArmRobot
from deploy.skeleton import add_inertia
from sim.scenario import Mismatch


@dataclass(frozen=True)
class Drawn:
    """What was drawn for one run."""

    coulomb: NDArray[np.float64]
    """Joint Coulomb friction, shape (joints,) [N m]."""
    lag: float
    """Of the platform drive [s]."""
    noise: float
    """Factor on every sensor's stated noise."""


def apply_mismatch(
    skeleton: Any, robot: Robot, mismatch: Mismatch, rng: np.random.Generator
) -> Drawn:
    """Change inertias, friction and payload of ``skeleton``; return what the drive and sensors use.

    Masses and inertias differ by up to ``mismatch.inertia``, either way, link by link.
    """
    return _apply(
        skeleton,
        robot.arm.links,
        ["pen_holder"],
        Joints(robot.arm.joints, robot.arm.coulomb_friction, robot.arm.viscous_friction),
        robot.platform.lag,
        mismatch,
        rng,
    )


def apply_two_arm_mismatch(
    skeleton: Any, robot: TwoArmRobot, mismatch: Mismatch, rng: np.random.Generator
) -> Drawn:
    """The same for a two-armed robot, of which each palm has a payload of its own."""
    arms = robot.arms
    return _apply(
        skeleton,
        [skeleton.getJoint(name).getChildBodyNode().getName() for name in arms.joints],
        list(robot.palms.links),
        Joints(arms.joints, arms.coulomb_friction * 2, arms.viscous_friction * 2),
        robot.platform.lag,
        mismatch,
        rng,
    )


@dataclass(frozen=True)
class Joints:
    """Names and described friction [N m], [N m s/rad] of the joints that differ."""

    names: Sequence[str]
    coulomb: Sequence[float]
    viscous: Sequence[float]


def _apply(
    skeleton: Any,
    links: Sequence[str],
    tools: Sequence[str],
    joints: Joints,
    lag: float,
    mismatch: Mismatch,
    rng: np.random.Generator,
) -> Drawn:
    def factor(width: float) -> float:
        return 1.0 + width * rng.uniform(-1.0, 1.0)

    for link in links:
        body = skeleton.getBodyNode(link)
        old = body.getInertia()
        body.setInertia(
            dart.dynamics.Inertia(
                old.getMass() * factor(mismatch.inertia),
                old.getLocalCOM(),
                old.getMoment() * factor(mismatch.inertia),
            )
        )
    for tool in tools:
        # a payload is heavier or lighter than believed; the tool cannot weigh less than nothing
        holder = skeleton.getBodyNode(tool)
        payload = max(mismatch.payload * rng.uniform(-1.0, 1.0), 0.01 - holder.getMass())
        add_inertia(holder, np.zeros((3, 3)), payload)

    coulomb = np.array([c * factor(mismatch.friction) for c in joints.coulomb])
    for name, friction, viscous in zip(joints.names, coulomb, joints.viscous, strict=True):
        joint = skeleton.getJoint(name)
        joint.setCoulombFriction(0, friction)
        joint.setDampingCoefficient(0, viscous * factor(mismatch.friction))
    return Drawn(
        coulomb=coulomb,
        lag=lag * factor(mismatch.lag),
        noise=rng.uniform(1.0, max(1.0, mismatch.sensor_noise)),
    )
