"""What the hand believes itself to be: kinematics and dynamics with coupled joints, platform still.

A follower joint (distal links, the second spread) moves as its leader does: rates of all joints
are S times the rates of the eleven driven ones, so motion maps with J S. But its gear does not let
loads back: a follower holds itself. Forces therefore map with the *leaders' columns* of J alone,
the inertia is the leaders' rows of M S, and gravity the leaders' entries (docs/grasping.md). With
S^T J^T instead, fingertips bounce.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deploy.robot import HandRobot
from deploy.skeleton import hand_coupling, load_hand_skeleton

Array = NDArray[np.float64]

JOINTS = 11
"""Driven ones: seven of the arm, the spread, three flexions."""
ARM = slice(0, 7)
SPREAD = 7
FLEX = slice(8, 11)
FINGERS = 3


@dataclass(slots=True, eq=False)
class Placed:
    """The hand at one state; all in B.

    Attributes:
        q, qd: of the driven joints, shape (11,) [rad], [rad/s].
        x: middles of the tips, shape (3, 3), a row a finger [m].
        JS: velocities of them by driven rates, shape (3, 3, 11): finger, axis, joint.
        JL: the leaders' columns of the plain Jacobian, same shape; forces map with it.
        M: leaders' rows of M S, shape (11, 11) [kg m^2].
        h: leaders' entries of gravity and velocity terms, shape (11,) [N m].
    """

    q: Array
    qd: Array
    x: Array
    JS: Array
    JL: Array
    M: Array
    h: Array

    @property
    def v(self) -> Array:
        """Velocities of the tips' middles, shape (3, 3) [m/s]."""
        return self.JS @ self.qd


class HandModel:
    """Nominal kinematics and dynamics of arm and hand.

    Args:
        name: of the robot's folder in deploy/robots.

    Raises:
        BadFile: no such robot, or one of another kind.
    """

    def __init__(self, name: str) -> None:
        self.robot: HandRobot
        self.robot, self._skeleton = load_hand_skeleton(name)
        self.leaders, self.S = hand_coupling(self.robot, self._skeleton)
        hand = self.robot.hand
        self._tips = [self._skeleton.getBodyNode(tip) for tip in hand.tips]
        self._palm = self._skeleton.getBodyNode(hand.palm)
        self.lower: Array = np.array(self._skeleton.getPositionLowerLimits())[self.leaders]
        self.upper: Array = np.array(self._skeleton.getPositionUpperLimits())[self.leaders]
        self.limit = np.array(self.robot.arm.torque_limit + hand.torque_limit)
        self.coulomb = np.array(self.robot.arm.coulomb_friction + hand.coulomb_friction)

    def place(self, q: Array, qd: Array) -> Placed:
        """Kinematics and dynamics at driven positions and rates, shape (11,) each."""
        self._skeleton.setPositions(self.S @ q)
        self._skeleton.setVelocities(self.S @ qd)
        J = np.array([self._skeleton.getLinearJacobian(tip) for tip in self._tips])
        x = np.array([tip.getWorldTransform().translation() for tip in self._tips]).reshape(3, 3)
        M = self._skeleton.getMassMatrix()[self.leaders] @ self.S
        h = self._skeleton.getCoriolisAndGravityForces()[self.leaders]
        return Placed(q, qd, x, J @ self.S, J[:, :, self.leaders], M, h)

    def tip_rotations(self) -> Array:
        """R_BT of the tips where the model was last placed, shape (3, 3, 3)."""
        return np.array([tip.getWorldTransform().rotation() for tip in self._tips])

    def palm(self) -> tuple[Array, Array]:
        """R_BH and p_BH where the model was last placed."""
        X = self._palm.getWorldTransform()
        return np.array(X.rotation()), np.array(X.translation()).reshape(3)

    def palm_at(self, q: Array) -> tuple[Array, Array, Array]:
        """R_BH, p_BH and the palm's Jacobian by the arm's joints (angular, linear), (6, 7)."""
        self._skeleton.setPositions(self.S @ q)
        J = self._skeleton.getWorldJacobian(self._palm)[:, self.leaders[:7]]
        R, p = self.palm()
        return R, p, np.array(J)
