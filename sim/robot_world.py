"""What every DART world with a robot in it is made of.

Traps of dartpy that shape it: sleeping must be off for measurements, and shape nodes must outlive
contacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import dartpy as dart
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.skeleton import PLATFORM
from sim.effects import GRAVITY

Array = NDArray[np.float64]

WHEELS = ("platform_x", "platform_y", "platform_heading")
"""Joints of the platform, the first of every robot."""
THICKNESS = 0.04
"""Of a table's top [m]."""


class RobotWorld:
    """A world with a robot, which is added to it first.

    Args:
        skeleton: of the robot.
        joints: names of its driven joints, which keep their limits.
        coulomb: their own Coulomb friction, shape (joints,) [N m].
        step: of the physics [s].
    """

    def __init__(
        self, skeleton: Any, joints: Sequence[str], coulomb: Sequence[float] | Array, step: float
    ) -> None:
        self._skeleton = skeleton
        self._joints = [skeleton.getJoint(name) for name in joints]
        self._coulomb = np.array(coulomb)
        for joint in self._joints:
            joint.setLimitEnforcement(True)
        self.set_brakes(0.0)
        self._world = dart.simulation.World()
        self._world.setTimeStep(step)
        self._set_gravity(GRAVITY)
        options = self._world.getDeactivationOptions()
        options.mEnabled = False
        self._world.setDeactivationOptions(options)

    @property
    def pose(self) -> Array:
        """X_WB as x, y [m], heading [rad]."""
        return np.asarray(self._skeleton.getPositions())[PLATFORM]

    @property
    def velocity(self) -> Array:
        """V_WB_W, shape (3,)."""
        return np.asarray(self._skeleton.getVelocities())[PLATFORM]

    def drive_inertia(self) -> Array:
        """What the drive accelerates along x, y [kg] and about the vertical [kg m^2]."""
        return np.diag(self._skeleton.getMassMatrix())[PLATFORM].copy()

    def set_wheel_friction(self, holding: tuple[float, float, float]) -> None:
        """Set the friction of the platform's wheels along x, y [N] and about the vertical [N m]."""
        for name, value in zip(WHEELS, holding, strict=True):
            self._skeleton.getJoint(name).setCoulombFriction(0, value)

    def set_brakes(self, holding: float) -> None:
        """Add to the own Coulomb friction of the driven joints [N m]."""
        for joint, own in zip(self._joints, self._coulomb.tolist(), strict=True):
            joint.setCoulombFriction(0, own + holding)

    def _set_gravity(self, downwards: float) -> None:
        self._world.setGravity([0.0, 0.0, -downwards])


def isometry(R: Array, p: Array) -> Any:
    """DART's transform of a rotation, shape (3, 3), and a position, shape (3,) [m]."""
    X = dart.math.Isometry3()
    X.set_rotation(R)
    X.set_translation(p)
    return X


def transform(body: Any) -> tuple[Array, Array]:
    """R_WX, shape (3, 3), and p_WX, shape (3,) [m], of a body."""
    X = body.getWorldTransform()
    return np.asarray(X.rotation()), np.asarray(X.translation()).reshape(3)


def listed(R: Array, p: Array) -> list[float]:
    """X_WX as x, y, z [m], then w, x, y, z of the unit quaternion."""
    quaternion = Rotation.from_matrix(R, assume_valid=True).as_quat(scalar_first=True)
    return [*p.tolist(), *quaternion.tolist()]


def add_cuboid(body: Any, size: Sequence[float]) -> Any:
    """Give a body the shape of a cuboid of this size [m]; returns the node, which can collide."""
    node = body.createShapeNode(dart.dynamics.BoxShape(list(size)))
    node.createCollisionAspect()
    node.createDynamicsAspect()
    node.createVisualAspect()
    return node


def table(at: Sequence[float], size: Sequence[float], yaw: float) -> Any:
    """Skeleton of a table's top that nothing moves.

    Args:
        at: middle of its upper face in W [m].
        size: along its x, along its y, thickness [m].
        yaw: turn about the vertical [rad].
    """
    skeleton = dart.dynamics.Skeleton("table")
    skeleton.setMobile(False)
    joint, body = skeleton.createWeldJointAndBodyNodePair()
    body.setName("table")
    add_cuboid(body, size)
    R = Rotation.from_rotvec([0.0, 0.0, yaw]).as_matrix()
    p = np.array(at) - [0.0, 0.0, size[2] / 2]
    joint.setTransformFromParentBodyNode(isometry(R, p))
    return skeleton
