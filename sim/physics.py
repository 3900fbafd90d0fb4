"""The DART world: robot, whiteboard, contact of pen and board.

The traps of dartpy that shape this file: shape nodes must outlive contacts, sleeping must be off
for measurements, force actuators are not clamped, and external forces last one step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import dartpy as dart
import numpy as np
from numpy.typing import NDArray

from deploy.robot import Robot
from deploy.skeleton import ARM, PLATFORM, load_skeleton
from sim.effects import GRAVITY, Effects
from sim.mismatch import Drawn, apply_mismatch
from sim.scenario import World

Array = NDArray[np.float64]
DT = 0.001
BOARD_THICKNESS = 0.04
FORCE_MOMENT = np.array([3, 4, 5, 0, 1, 2])
"""DART's wrenches have the moment first."""


class Physics:
    """Robot and world at 1 ms.

    Attributes:
        robot: the description (not the truth).
        drawn: how this run's robot differs from it.
        bodies: what can be pushed.
        X_WS: true pose of the board, rotation (3, 3) and position (3,).
    """

    def __init__(self, name: str, world: World, rng: np.random.Generator) -> None:
        self.robot: Robot
        self.robot, self._skeleton = load_skeleton(name)
        self.bodies = ("platform", *self.robot.arm.links)
        self.drawn: Drawn = apply_mismatch(self._skeleton, self.robot, world.mismatch, rng)
        self.R_WS = world.board.rotation()
        self.p_WS = self._stood = world.board.position()
        self._world = dart.simulation.World()
        self._world.setTimeStep(DT)
        self._world.setGravity([0.0, 0.0, -GRAVITY])
        self._sleepless()
        self._world.addSkeleton(self._skeleton)
        board, board_node = self._board(world)
        self._world.addSkeleton(board)
        self._pen = self._skeleton.getBodyNode("pen")
        self._holder = self._skeleton.getBodyNode("pen_holder")
        # held for the life of the world: a contact whose shape node is gone crashes the process
        self._nodes = [board_node]
        for body in self._skeleton.getBodyNodes():
            self._nodes += list(body.getShapeNodes())
        self._pen_nodes = [n for n in self._pen.getShapeNodes() if n.hasCollisionAspect()]
        for node in self._pen_nodes:
            node.getDynamicsAspect().setFrictionCoeff(world.friction_pen)
        for joint in self.robot.arm.joints:
            self._skeleton.getJoint(joint).setLimitEnforcement(True)
        self._skeleton.getJoint("pen_spring").setLimitEnforcement(True)
        start = np.zeros(self._skeleton.getNumDofs())
        start[PLATFORM] = world.platform_start
        start[ARM] = self.robot.arm.rest
        self._skeleton.setPositions(start)
        self._limit = np.array(self.robot.arm.torque_limit)
        self._lowest = -self._limit
        self._forces = np.zeros_like(start)
        self._vertical = 0.0
        self._normal, self._R_SW = self.R_WS[:, 2], self.R_WS.T
        self._tip_radius = self.robot.pen.tip_radius
        self._read()
        self.acceleration = np.zeros(3)
        self.applied = np.zeros(len(self.robot.arm.joints))

    def _sleepless(self) -> None:
        options = self._world.getDeactivationOptions()
        options.mEnabled = False
        self._world.setDeactivationOptions(options)

    def _board(self, world: World) -> tuple[Any, Any]:
        board = dart.dynamics.Skeleton("board")
        _, body = board.createWeldJointAndBodyNodePair()
        size = [world.board.width, world.board.height, BOARD_THICKNESS]
        node = body.createShapeNode(dart.dynamics.BoxShape(size))
        node.createCollisionAspect()
        node.createDynamicsAspect().setFrictionCoeff(world.friction_pen)
        node.createVisualAspect()
        self._board_joint = body.getParentJoint()
        self._place_board()
        return board, node

    def _place_board(self) -> None:
        pose = dart.math.Isometry3()
        pose.set_rotation(self.R_WS)
        pose.set_translation(self.p_WS - self.R_WS[:, 2] * BOARD_THICKNESS / 2)
        self._board_joint.setTransformFromParentBodyNode(pose)

    # --- state ------------------------------------------------------------------------------

    def _read(self) -> None:
        """Fetch the state once for all who ask; new arrays, so that messages may keep them."""
        self._positions: Array = self._skeleton.getPositions()
        self._velocities: Array = self._skeleton.getVelocities()

    @property
    def pose(self) -> Array:
        """X_WB as x, y [m], heading [rad]."""
        return self._positions[PLATFORM]

    @property
    def velocity(self) -> Array:
        """V_WB_W, shape (3,)."""
        return self._velocities[PLATFORM]

    @property
    def q(self) -> Array:
        """True joint positions, shape (n,) [rad]."""
        return self._positions[ARM]

    @property
    def qd(self) -> Array:
        """True joint velocities, shape (n,) [rad/s]."""
        return self._velocities[ARM]

    def drive_inertia(self) -> Array:
        """What the drive accelerates along x, y [kg] and about the vertical [kg m^2]."""
        return np.diag(self._skeleton.getMassMatrix())[PLATFORM].copy()

    def tip(self) -> Array:
        """Pen tip p_ST_S, shape (3,) [m]: where the tip sphere is nearest to the board."""
        centre = self._pen.getTransform().translation()
        p: Array = self._R_SW @ (centre - self.p_WS)
        p[2] -= self._tip_radius
        return p

    def contact_force(self) -> float:
        """Force of the pen on the board along its normal [N], 0 without contact."""
        force = 0.0
        for contact in self._world.getLastCollisionResult().getContacts():
            first = contact.collisionObject1.getShapeFrame()
            second = contact.collisionObject2.getShapeFrame()
            if first in self._pen_nodes or second in self._pen_nodes:
                force += abs(float(np.dot(contact.force, self._normal)))
        return force

    def wrench(self) -> Array:
        """Force [N] and moment [N m] of world and weight on the tool, in the load cell's frame."""
        transmitted: Array = self._holder.getBodyForce()
        return -transmitted[FORCE_MOMENT]

    def set_friction(self, coulomb: Array | None) -> None:
        """Set the joints' Coulomb friction, shape (n,) [N m]; None for the robot's own."""
        values = self.drawn.coulomb if coulomb is None else coulomb
        for joint, value in zip(self.robot.arm.joints, values, strict=True):
            self._skeleton.getJoint(joint).setCoulombFriction(0, float(value))

    def set_wheel_friction(self, holding: tuple[float, float, float]) -> None:
        """Set the friction of the platform's wheels along x, y [N] and about the vertical [N m]."""
        for joint, value in zip(
            ("platform_x", "platform_y", "platform_heading"), holding, strict=True
        ):
            self._skeleton.getJoint(joint).setCoulombFriction(0, value)

    # --- step -------------------------------------------------------------------------------

    def step(self, torque: Array, drive: Sequence[float], effects: Effects) -> None:
        """Advance by 1 ms.

        Args:
            torque: joint torques asked for, shape (n,) [N m]; the motors clamp them.
            drive: force of the drive in B along x, y [N] and about the vertical [N m].
            effects: disturbances that act.
        """
        self.applied = np.minimum(np.maximum(torque, self._lowest), self._limit)
        heading = float(self._positions[2])
        c, s = math.cos(heading), math.sin(heading)
        forces = self._forces
        x, y, turn = drive
        forces[0] = c * x - s * y
        forces[1] = s * x + c * y
        forces[2] = turn
        if effects.yaw:
            forces[2] += effects.yaw * self.drive_inertia()[2]
        if effects.slips:
            forces[:2] += self.drive_inertia()[:2] * effects.slip_acceleration
        forces[ARM] = self.applied
        self._skeleton.setForces(forces)
        for name, force in effects.pushes:
            body = self._skeleton.getBodyNode(name)
            body.addExtForce(force, body.getLocalCOM(), False, True)
        if effects.vertical != self._vertical:
            # a floor that accelerates upwards is felt as more gravity
            self._vertical = effects.vertical
            self._world.setGravity([0.0, 0.0, -GRAVITY - effects.vertical])
        if effects.board is not None:
            self.p_WS = self._stood + effects.board
            self._place_board()
        before = self.velocity
        self._world.step()
        self._read()
        self.acceleration = (self.velocity - before) / DT
