"""The DART world of a two-armed robot: robot, table, box; what touches are palms, box and torso.

Traps of dartpy that shape this file: shape nodes must outlive contacts, force actuators are not
clamped, external forces last one step. Two flat palms on a box are redundant contacts: the default
solver lifts it cleanly, the one with exact friction cones tips it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import dartpy as dart
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.arms import Palms
from deploy.robot import TwoArmRobot
from deploy.skeleton import BOTH, PLATFORM, TWO_ARM_DOFS, load_two_arm_skeleton
from sim.effects import GRAVITY, Effects
from sim.mismatch import Drawn, apply_two_arm_mismatch
from sim.robot_world import (
    THICKNESS,
    RobotWorld,
    add_cuboid,
    isometry,
    listed,
    table,
    transform,
)
from sim.rolling import on_platform
from sim.scenario import Box, World

Array = NDArray[np.float64]

STEP = 0.004
"""Longest step of the physics [s]."""
PALMS = ("left_palm", "right_palm")
PADS = slice(TWO_ARM_DOFS, TWO_ARM_DOFS + 2)
"""Pads of the palms among the simulated degrees of freedom, which the controllers' have not."""
SHALLOW = 2e-6
"""What nobody could measure of a pad's place [m]."""
RUBBER = 1.5
"""Friction of palms and table, high enough that the box's own decides [1]."""


class TwoArmPhysics(RobotWorld):
    """Robot and world, advanced by the period of the robot's arm control.

    Attributes:
        robot: the description (not the truth).
        drawn: how this run's robot differs from it.
        box: whether there is one.
        bodies: names of what can be pushed.
    """

    def __init__(
        self, name: str, world: World, start: tuple[float, float, float], rng: np.random.Generator
    ) -> None:
        self.robot: TwoArmRobot
        self.robot, skeleton = load_two_arm_skeleton(name)
        self.drawn: Drawn = apply_two_arm_mismatch(skeleton, self.robot, world.mismatch, rng)
        self._substeps = math.ceil(self.robot.period / STEP - 1e-9)
        step = self.robot.period / self._substeps
        super().__init__(skeleton, self.robot.arms.joints, self.drawn.coulomb, step)
        self._world.addSkeleton(self._skeleton)
        top = world.table
        self._world.addSkeleton(table((top.x, top.y, top.height), (*top.size, THICKNESS), top.yaw))
        self._box: Any = None
        if world.box is not None:
            box = _box(world.box, world.table.height)
            self._world.addSkeleton(box)
            self._box = box.getBodyNode(0)
        self.box = self._box is not None
        self._palms = [self._skeleton.getBodyNode(link) for link in self.robot.palms.links]
        # what is touched is the pad; it counts as its palm
        self._named = {
            _pad(palm, self.robot.palms, away).getName(): known
            for palm, known, away in zip(self._palms, PALMS, (1.0, -1.0), strict=True)
        }
        self._known = dict(zip(PALMS, self._palms, strict=True))
        if self.box:
            self._known["box"] = self._box
        hidden = ("_carrier", "_pad")
        bodies = [b for b in self._skeleton.getBodyNodes() if not b.getName().endswith(hidden)]
        self._pushable = {b.getName(): b for b in bodies} | self._known
        self.bodies = tuple(self._pushable)
        # held for the life of the world: a contact whose shape node is gone crashes the process
        self._nodes: list[tuple[Any, str]] = []
        for index in range(self._world.getNumSkeletons()):
            for body in self._world.getSkeleton(index).getBodyNodes():
                counts_as = self._named.get(body.getName(), body.getName())
                self._nodes += [(node, counts_as) for node in body.getShapeNodes()]
        self._by_node = {id(node): counts_as for node, counts_as in self._nodes}
        for node, body_name in self._nodes:
            if node.hasCollisionAspect() and body_name != "box":
                node.getDynamicsAspect().setFrictionCoeff(RUBBER)
        positions = np.zeros(self._skeleton.getNumDofs())
        positions[PLATFORM] = start
        positions[BOTH] = self.robot.arms.rest
        self._skeleton.setPositions(positions)
        self._limit = np.array(self.robot.arms.torque_limit * 2)
        self._forces = np.zeros_like(positions)
        # what the load cells take out: the weight of the palm as described
        _, described = load_two_arm_skeleton(name)
        self._weight = [
            described.getBodyNode(link).getMass() * GRAVITY for link in self.robot.palms.links
        ]
        self._contact = self._hardest = self._contact_forces()
        self.acceleration = np.zeros(3)
        self.applied = np.zeros(14)

    # --- state ------------------------------------------------------------------------------

    @property
    def q(self) -> Array:
        """True joint positions, left then right, shape (14,) [rad]."""
        return self._skeleton.getPositions()[BOTH]

    @property
    def qd(self) -> Array:
        """True joint velocities, shape (14,) [rad/s]."""
        return self._skeleton.getVelocities()[BOTH]

    def transform(self, body: str) -> tuple[Array, Array]:
        """R_WX, shape (3, 3), and p_WX, shape (3,) [m], of a body named in ``bodies``."""
        return transform(self._pushable[body])

    def known(self) -> dict[str, list[float]]:
        """X_WX of palms and box: x, y, z [m], then w, x, y, z of the unit quaternion."""
        return {name: listed(*transform(body)) for name, body in self._known.items()}

    def hardest_forces(self) -> dict[str, list[float]]:
        """Largest contact force on palms and box since this was last asked, in W, x, y, z [N]."""
        hardest, self._hardest = self._hardest, self._contact
        return hardest

    def _contact_forces(self) -> dict[str, list[float]]:
        """Contact force on palms and box in the last step, in W, each x, y, z [N]."""
        sums = {name: np.zeros(3) for name in self._known}
        for contact in self._world.getLastCollisionResult().getContacts():
            force = np.asarray(contact.force).reshape(3)
            first, second = contact.collisionObject1, contact.collisionObject2
            for side, sign in ((first, 1.0), (second, -1.0)):
                name = self._body_of(side.getShapeFrame())
                if name in sums:
                    sums[name] += sign * force
        return {name: force.tolist() for name, force in sums.items()}

    def wrench(self) -> Array:
        """Of the world on the palms, each in its P, without their weight, shape (12,) [N, N m]."""
        out = np.empty(12)
        for i, (palm, weight) in enumerate(zip(self._palms, self._weight, strict=True)):
            transmitted = palm.getBodyForce()
            R, _ = transform(palm)
            out[6 * i : 6 * i + 3] = -transmitted[3:] + weight * R[2]
            out[6 * i + 3 : 6 * i + 6] = -transmitted[:3]
        return out

    # --- step -------------------------------------------------------------------------------

    def step(self, torque: Array, drive: Sequence[float], effects: Effects) -> None:
        """Advance by the robot's period.

        Args:
            torque: joint torques asked for, shape (14,) [N m]; the motors clamp them.
            drive: force of the drive in B along x, y [N] and about the vertical [N m].
            effects: disturbances that act.
        """
        self.applied = np.minimum(np.maximum(torque, -self._limit), self._limit)
        forces, heading = self._forces, float(self.pose[2])
        forces[PLATFORM] = on_platform(drive, heading, effects, self.drive_inertia)
        forces[BOTH] = self.applied
        # a floor that accelerates upwards is felt as more gravity
        self._set_gravity(GRAVITY + effects.vertical)
        before = self.velocity
        for _ in range(self._substeps):
            forces[PADS] = self._pad_forces()
            self._skeleton.setForces(forces)
            for name, force in effects.pushes:
                body = self._pushable[name]
                body.addExtForce(force, body.getLocalCOM(), False, True)
            self._world.step()
            self._contact = self._contact_forces()
            self._hardest = {
                name: max(self._hardest[name], force, key=_size)
                for name, force in self._contact.items()
            }
        self.acceleration = (self.velocity - before) / self.robot.period

    def _pad_forces(self) -> Array:
        """Of the pads' springs and dampers, left then right, shape (2,) [N].

        The solver of contacts takes no account of what springs and dampers in joints do within a
        step: it would find a pad as soft as it is light. They are forces, therefore; of a
        pad that touches nothing, those of the end of the step, or so light a face would not rest.
        """
        pad, dt = self.robot.palms.pad, self._world.getTimeStep()
        touched = self._pads_touch()
        x, v = self._skeleton.getPositions()[PADS], self._skeleton.getVelocities()[PADS]
        free = -pad.stiffness * (x + v * dt) - pad.damping * v
        free /= 1.0 + (pad.damping * dt + pad.stiffness * dt * dt) / pad.mass
        pressed = np.minimum(pad.stiffness * x + pad.damping * v, pad.plateau)
        return np.where(touched, -pressed, free)

    def _pads_touch(self) -> list[bool]:
        """Whether each pad touches anything in the step to come, left then right.

        Not whether it did in the last: the solver lets a contact grow as shallow as rounding, and
        a step that finds none would have a spring throw its pad into what it lay on. A pad that is
        pressed in and lost its contact so is put back by ``SHALLOW``.
        """
        touching = self._touching()
        x = self._skeleton.getPositions()
        lost = [
            any(self._contact[name]) and name not in touching and pressed > SHALLOW
            for name, pressed in zip(PALMS, x[PADS], strict=True)
        ]
        if any(lost):
            x[PADS] -= SHALLOW * np.array(lost)
            self._skeleton.setPositions(x)
            touching = self._touching()
        return [name in touching for name in PALMS]

    def _touching(self) -> set[str]:
        """Who touches anything where everything is now."""
        solver = self._world.getConstraintSolver()
        found = dart.collision.CollisionResult()
        solver.getCollisionGroup().collide(solver.getCollisionOption(), found)
        return {
            self._body_of(side.getShapeFrame())
            for contact in found.getContacts()
            for side in (contact.collisionObject1, contact.collisionObject2)
        }

    def _body_of(self, frame: Any) -> str:
        return self._by_node.get(id(frame), "")


def _size(force: list[float]) -> float:
    return math.hypot(*force)


def _pad(palm: Any, palms: Palms, away: float) -> Any:
    """Put a pad in the place of a palm's face: a body on a spring along the palm's normal.

    Args:
        palm: body of the palm; it gives its shape and some of its mass to the pad.
        palms: their description.
        away: which way along y of P the pad gives way.
    """
    pad = palms.pad
    share = pad.mass / palm.getMass()
    whole = palm.getInertia()

    def part(of: float) -> Any:
        return dart.dynamics.Inertia(
            of * whole.getMass(), whole.getLocalCOM(), of * np.asarray(whole.getMoment())
        )

    palm.setInertia(part(1.0 - share))
    for node in palm.getShapeNodes():
        node.removeCollisionAspect()
    joint, body = palm.createPrismaticJointAndBodyNodePair()
    name = palm.getName().replace("_palm", "_pad")
    joint.setName(name)
    body.setName(name)
    joint.setAxis([0.0, away, 0.0])
    joint.setPositionUpperLimit(0, pad.stroke)
    joint.setLimitEnforcement(True)
    body.setInertia(part(share))
    add_cuboid(body, palms.size)
    return body


def _box(box: Box, height: float) -> Any:
    skeleton = dart.dynamics.Skeleton("box")
    _, body = skeleton.createFreeJointAndBodyNodePair()
    body.setName("box")
    add_cuboid(body, box.size).getDynamicsAspect().setFrictionCoeff(box.friction)
    x, y, z = box.size
    moment = np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * (box.mass / 12.0)
    body.setInertia(dart.dynamics.Inertia(box.mass, np.array(box.com), moment))
    R = Rotation.from_rotvec([0.0, 0.0, box.yaw])
    if box.on_side:
        R = R * Rotation.from_rotvec([math.pi / 2, 0.0, 0.0])
    above = 0.5 * (y if box.on_side else z)
    p = np.array([box.x, box.y, height + above])
    skeleton.setPositions(dart.dynamics.FreeJoint.convertToPositions(isometry(R.as_matrix(), p)))
    return skeleton
