"""Makes the simulated robot differ from its description, as every real one does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import dartpy as dart
import numpy as np
from numpy.typing import NDArray

from deploy.robot import Robot
from deploy.skeleton import add_inertia
from sim.scenario import Mismatch


@dataclass(frozen=True)
class Drawn:
    """What was drawn for one run."""

    coulomb: NDArray[np.float64]
    """Joint Coulomb friction, shape (6,) [N m]."""
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

    def factor(width: float) -> float:
        return 1.0 + width * rng.uniform(-1.0, 1.0)

    for index in range(1, 7):
        body = skeleton.getBodyNode(f"link{index}")
        old = body.getInertia()
        body.setInertia(
            dart.dynamics.Inertia(
                old.getMass() * factor(mismatch.inertia),
                old.getLocalCOM(),
                old.getMoment() * factor(mismatch.inertia),
            )
        )
    # a payload is heavier or lighter than believed; the tool cannot weigh less than nothing
    holder = skeleton.getBodyNode("pen_holder")
    payload = max(mismatch.payload * rng.uniform(-1.0, 1.0), 0.01 - holder.getMass())
    add_inertia(holder, np.zeros((3, 3)), payload)

    coulomb = np.array([c * factor(mismatch.friction) for c in robot.arm.coulomb_friction])
    for name, friction, viscous in zip(
        robot.arm.joints, coulomb, robot.arm.viscous_friction, strict=True
    ):
        joint = skeleton.getJoint(name)
        joint.setCoulombFriction(0, friction)
        joint.setDampingCoefficient(0, viscous * factor(mismatch.friction))
    return Drawn(
        coulomb=coulomb,
        lag=robot.platform.lag * factor(mismatch.lag),
        noise=rng.uniform(1.0, max(1.0, mismatch.sensor_noise)),
    )
