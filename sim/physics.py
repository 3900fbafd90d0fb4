"""The DART world: robot, whiteboard, contact of pen and board.

The traps of dartpy that shape this file: shape nodes must outlive contacts, force actuators are not
clamped, and external forces last one step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import dartpy as dart
import numpy as np
from numpy.typing import NDArray

from deploy.robot import Robot
from deploy.skeleton import ARM, PLATFORM, load_skeleton
from sim.effects import GRAVITY, Effects
from sim.mismatch import Drawn, apply_mismatch
from sim.robot_world import RobotWorld, add_cuboid, isometry
from sim.rolling import on_platform
from sim.scenario import World

Array = NDArray[np.float64]
DT = 0.001
BOARD_THICKNESS = 0.04
FORCE_MOMENT = np.array([3, 4, 5, 0, 1, 2])
"""DART's wrenches have the moment first."""


class Physics(RobotWorld):
    """Robot and world at 1 ms.

    Attributes:
        robot: the description (not the truth).
        drawn: how this run's robot differs from it.
        bodies: what can be pushed.
        X_WS: true pose of the board, rotation (3, 3) and position (3,).
    """

    def __init__(self, name: str, world: World, rng: np.random.Generator) -> None:
        self.robot: Robot
        self.robot, skeleton = load_skeleton(name)
        self.bodies = ("platform", *self.robot.arm.links)
        self.drawn: Drawn = apply_mismatch(skeleton, self.robot, world.mismatch, rng)
        super().__init__(skeleton, self.robot.arm.joints, self.drawn.coulomb, DT)
        self.R_WS = world.board.rotation()
        self.p_WS = self._stood = world.board.position()
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

    def _board(self, world: World) -> tuple[Any, Any]:
        board = dart.dynamics.Skeleton("board")
        _, body = board.createWeldJointAndBodyNodePair()
        size = [world.board.width, world.board.height, BOARD_THICKNESS]
        node = add_cuboid(body, size)
        node.getDynamicsAspect().setFrictionCoeff(world.friction_pen)
        self._board_joint = body.getParentJoint()
        self._place_board()
        return board, node

    def _place_board(self) -> None:
        middle = self.p_WS - self.R_WS[:, 2] * BOARD_THICKNESS / 2
        self._board_joint.setTransformFromParentBodyNode(isometry(self.R_WS, middle))

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

    # --- step -------------------------------------------------------------------------------

    def step(self, torque: Array, drive: Sequence[float], effects: Effects) -> None:
        """Advance by 1 ms.

        Args:
            torque: joint torques asked for, shape (n,) [N m]; the motors clamp them.
            drive: force of the drive in B along x, y [N] and about the vertical [N m].
            effects: disturbances that act.
        """
        self.applied = np.minimum(np.maximum(torque, self._lowest), self._limit)
        forces, heading = self._forces, float(self._positions[2])
        forces[PLATFORM] = on_platform(drive, heading, effects, self.drive_inertia)
        forces[ARM] = self.applied
        self._skeleton.setForces(forces)
        for name, force in effects.pushes:
            body = self._skeleton.getBodyNode(name)
            body.addExtForce(force, body.getLocalCOM(), False, True)
        if effects.vertical != self._vertical:
            # a floor that accelerates upwards is felt as more gravity
            self._vertical = effects.vertical
            self._set_gravity(GRAVITY + effects.vertical)
        if effects.board is not None:
            self.p_WS = self._stood + effects.board
            self._place_board()
        before = self.velocity
        self._world.step()
        self._read()
        self.acceleration = (self.velocity - before) / DT
