"""The hand's model on a platform that moves: what the platform does is felt as forces in B.

B is where the model stands, so that whoever computes in B need not know that it moves. Of the
platform come in its velocity, which bends the velocity terms, and its acceleration, which loads
every joint with M_ab a_b (docs/arm.md, "Torque law").
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from arm.hand.model import HandModel, Placed
from arm.model import STANDING, Base
from deploy.skeleton import PLATFORM

Array = NDArray[np.float64]


class MovingHandModel(HandModel):
    """``HandModel`` on a platform in motion; gravity and velocity terms h contain its forces.

    Args:
        name: of the robot's folder in deploy/robots.

    Raises:
        BadFile: no such robot, or one of another kind.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.move(STANDING)

    def move(self, base: Base) -> None:
        """Take in how the platform moves."""
        self._velocity = into(base, base.velocity)
        self._acceleration = into(base, base.acceleration)

    def place(self, q: Array, qd: Array) -> Placed:
        """Kinematics in B and dynamics at driven positions and rates, shape (11,) each."""
        rates = self.S @ qd
        rates[PLATFORM] = self._velocity
        self._skeleton.setPositions(self.S @ q)
        self._skeleton.setVelocities(rates)
        J = np.array([self._skeleton.getLinearJacobian(tip) for tip in self._tips])
        x = np.array([tip.getWorldTransform().translation() for tip in self._tips]).reshape(3, 3)
        M = self._skeleton.getMassMatrix()[self.leaders]
        h = self._skeleton.getCoriolisAndGravityForces()[self.leaders]
        h = h + M[:, PLATFORM] @ self._acceleration
        return Placed(q, qd, x, J @ self.S, J[:, :, self.leaders], M @ self.S, h)


def into(base: Base, planar: Array) -> Array:
    """A planar velocity or acceleration (3,) along axes of O, along those of B."""
    c, s = math.cos(base.pose[2]), math.sin(base.pose[2])
    x, y, w = planar.tolist()
    return np.array([c * x + s * y, c * y - s * x, w])


def turned(base: Base) -> Array:
    """R_OB, shape (3, 3)."""
    c, s = math.cos(base.pose[2]), math.sin(base.pose[2])
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def seen_from(base: Base, p: Array) -> Array:
    """p_B of a point p_O, shape (3,) [m]."""
    return np.asarray(turned(base).T @ (p - [base.pose[0], base.pose[1], 0.0]))
