"""What the arms believe their robot to be: kinematics and dynamics of two arms on a platform.

Everything is in B: what the palms do to a box on a table does not depend on where the platform is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deploy.robot import TwoArmRobot
from deploy.skeleton import BOTH, TWO_ARM_DOFS, load_two_arm_skeleton

Array = NDArray[np.float64]

JOINTS = 14
SIDES = (1.0, -1.0)
"""Which way along y of B a palm is from the box: left, right."""
_LINEAR_FIRST = np.array([3, 4, 5, 0, 1, 2])


@dataclass(slots=True, eq=False)
class Palms:
    """Where both palms are and how the joints move them, left then right.

    Attributes:
        p: p_BP of their middles, two of shape (3,) [m].
        R: R_BP, two of shape (3, 3).
        J: linear then angular velocity in B by all joint rates, two of shape (6, 14).
        q: joint positions there, shape (14,) [rad].
    """

    p: tuple[Array, Array]
    R: tuple[Array, Array]
    J: tuple[Array, Array]
    q: Array


class TwoArmModel:
    """Nominal kinematics and dynamics of two arms, the platform taken to be at rest.

    Args:
        name: of the robot's folder in deploy/robots.

    Raises:
        BadFile: no such robot, or one of another kind.
    """

    def __init__(self, name: str) -> None:
        self.robot: TwoArmRobot
        self.robot, self._skeleton = load_two_arm_skeleton(name)
        self._palms = [self._skeleton.getBodyNode(link) for link in self.robot.palms.links]
        self._positions = np.zeros(TWO_ARM_DOFS)
        self._velocities = np.zeros(TWO_ARM_DOFS)
        self.q_lower: Array = np.array(self._skeleton.getPositionLowerLimits())[BOTH]
        self.q_upper: Array = np.array(self._skeleton.getPositionUpperLimits())[BOTH]

    def place(self, q: Array, qd: Array) -> Palms:
        """Set the model's state and return the kinematics of the palms there.

        Args:
            q: joint positions, shape (14,) [rad].
            qd: joint velocities, shape (14,) [rad/s].
        """
        self._positions[BOTH] = q
        self._velocities[BOTH] = qd
        self._skeleton.setPositions(self._positions)
        self._skeleton.setVelocities(self._velocities)
        poses = [palm.getWorldTransform().matrix() for palm in self._palms]
        J = [
            self._skeleton.getWorldJacobian(palm).take(_LINEAR_FIRST, axis=0)[:, BOTH]
            for palm in self._palms
        ]
        return Palms(
            p=(poses[0][:3, 3], poses[1][:3, 3]),
            R=(poses[0][:3, :3], poses[1][:3, :3]),
            J=(J[0], J[1]),
            q=q,
        )

    def dynamics(self) -> tuple[Array, Array]:
        """At the state last placed: inertia (14, 14) of the joints on a platform held fast, and
        torque of gravity and velocities (14,) [N m]."""
        mass = self._skeleton.getMassMatrix()
        bias = self._skeleton.getCoriolisAndGravityForces()
        return mass[BOTH, BOTH], bias[BOTH]
