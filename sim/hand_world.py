"""The DART world of a hand on an arm: robot, table, an object; touched by tips, links and palm.

The platform stands, unless it is said where it starts to roll from.

Traps of dartpy that shape this file: shape nodes must outlive contacts, force actuators are not
clamped. Coupled joints are plain mimics: with the coupler constraint and
friction the tips bounce (docs/grasping.md).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import dartpy as dart
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.robot import HandRobot
from deploy.skeleton import PLATFORM, hand_coupling, load_hand_skeleton
from sim.effects import GRAVITY
from sim.hand_objects import CURVED, Thing, build, find
from sim.hand_skin import Skin
from sim.robot_world import THICKNESS, WHEELS, RobotWorld, isometry, table, transform

Array = NDArray[np.float64]

TABLE = (0.5, 0.0, 0.5)
"""Middle of the table's top [m]."""
TABLE_SIZE = (0.5, 0.9, THICKNESS)
"""[m]"""
RUBBER = 1.5
"""Friction of tips and table, high enough that the object's own decides [1]."""
PLACE = (0.5, 0.0)
"""Where the object stands [m]."""


@dataclass(frozen=True)
class Top:
    """A table's top.

    Attributes:
        at: its middle in W [m].
        size: along its x, along its y, thickness [m].
        yaw: turn about the vertical [rad].
    """

    at: tuple[float, float, float] = TABLE
    size: tuple[float, float, float] = TABLE_SIZE
    yaw: float = 0.0


@dataclass(frozen=True)
class HandMismatch:
    """How much the simulated robot differs from its description, each way, drawn by seed."""

    inertia: float = 0.0
    """Of masses and moments, link by link [1]."""
    friction: float = 0.2
    """Of joint friction, where there is any [1]."""
    bias: float = 1.0
    """Of a load cell before it is tared [N]; a hundredth of it in moments [N m]."""


@dataclass(frozen=True)
class Setting:
    """What is in the world.

    Attributes:
        thing: a name or mesh file, see ``hand_objects.find``; None: the table is empty.
        yaw: of the object about its axis [rad].
        fixed: the object is bolted down.
        friction: of the object [1].
        mass: of the object [kg].
        scale: of its profile [1].
        arm_friction: the arm's joints have their Coulomb friction.
        finger_friction: the hand's drives have theirs.
        dead: finger whose load cell reads a constant, None if all work.
        mismatch: see there.
        step: of the physics [s].
        table: see there.
        place: of the object's foot over the floor [m].
        start: X_WB from which the platform rolls; None: it is bolted down at W.
    """

    thing: str | None = "roll"
    yaw: float = 0.0
    fixed: bool = True
    friction: float = 0.3
    mass: float = 0.5
    scale: float = 1.0
    arm_friction: bool = False
    finger_friction: bool = False
    dead: int | None = None
    mismatch: HandMismatch = HandMismatch()
    step: float = 0.001
    table: Top = Top()
    place: tuple[float, float] = PLACE
    start: tuple[float, float, float] | None = None


class HandWorld(RobotWorld):
    """Robot and world, advanced by the step of the physics.

    On a platform that is bolted down W is B, and whatever is in B below is in W of one that rolls.

    Attributes:
        robot: the description (not the truth).
        thing: the object, None if there is none.
    """

    def __init__(self, name: str, setting: Setting, rng: np.random.Generator) -> None:
        self.robot: HandRobot
        self.robot, skeleton = load_hand_skeleton(name)
        self.setting = setting
        self._leaders, self._S = hand_coupling(self.robot, skeleton)
        self._rng = rng
        hand = self.robot.hand
        self._tips = [skeleton.getBodyNode(tip) for tip in hand.tips]
        self._tip_weight = np.array([tip.getMass() * GRAVITY for tip in self._tips])
        driven = (*self.robot.arm.joints, *hand.drives)
        super().__init__(skeleton, driven, self._differ(skeleton), setting.step)
        self._bias = rng.uniform(-1.0, 1.0, (3, 6)) * setting.mismatch.bias
        self._bias[:, 3:] *= 0.01
        cell = self.robot.load_cell
        self._noise = np.repeat([cell.force_noise, cell.moment_noise], 3)
        self._start = np.zeros(3) if setting.start is None else np.array(setting.start)
        for joint_name in WHEELS:
            if setting.start is None:
                joint = self._skeleton.getJoint(joint_name)
                joint.setActuatorType(dart.dynamics.ActuatorType.LOCKED)
        self._world.getConstraintSolver().setCollisionDetector(
            dart.collision.FCLCollisionDetector()
        )
        self._world.addSkeleton(self._skeleton)
        top = setting.table
        self._world.addSkeleton(table(top.at, top.size, top.yaw))
        self.thing: Thing | None = None if setting.thing is None else find(setting.thing)
        self._object: Any = None
        self._skin: Skin | None = None
        if self.thing is not None:
            skeleton = build(
                self.thing, setting.friction, setting.fixed, setting.mass, setting.scale
            )
            self._object = skeleton.getBodyNode("object")
            self._stand(skeleton)
            if any(piece.kind in CURVED for piece in self.thing.pieces):
                self._skin = self._covered(skeleton)
            self._world.addSkeleton(skeleton)
        # held for the life of the world: a contact whose shape node is gone crashes the process
        self._nodes: list[tuple[Any, str]] = []
        for index in range(self._world.getNumSkeletons()):
            for body in self._world.getSkeleton(index).getBodyNodes():
                name = "object" if body.getName().startswith("object") else body.getName()
                self._nodes += [(node, name) for node in body.getShapeNodes()]
        for node, body_name in self._nodes:
            if node.hasCollisionAspect() and body_name != "object":
                node.getDynamicsAspect().setFrictionCoeff(RUBBER)
        self._limit = np.array(self.robot.arm.torque_limit + hand.torque_limit)
        self._forces = np.zeros(self._skeleton.getNumDofs())
        self.time = 0.0
        self.gravity_on_object = np.array([0.0, 0.0, -GRAVITY])
        self.push = np.zeros(3)

    # --- state ------------------------------------------------------------------------------

    def put(self, q: Array) -> None:
        """Place the driven joints, shape (11,) [rad]; everything rests."""
        positions = self._S @ q
        positions[PLATFORM] = self._start
        self._skeleton.setPositions(positions)
        self._skeleton.setVelocities(np.zeros(self._S.shape[0]))

    @property
    def q(self) -> Array:
        """True positions of the driven joints, arm then hand, shape (11,) [rad]."""
        return np.asarray(self._skeleton.getPositions())[self._leaders]

    @property
    def qd(self) -> Array:
        """True rates of them, shape (11,) [rad/s]."""
        return np.asarray(self._skeleton.getVelocities())[self._leaders]

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of what can be pushed."""
        bodies = (b.getName() for b in self._skeleton.getBodyNodes())
        own = tuple(b for b in bodies if not b.endswith("_carrier"))
        return own if self._object is None else (*own, "object")

    def tips(self) -> Array:
        """Middles of the tips in B, shape (3, 3) [m]."""
        return np.array([transform(tip)[1] for tip in self._tips])

    def cells(self, samples: int = 1) -> Array:
        """Wrench of the world on each tip in the tip's frame, with bias and noise, (3, 6).

        Noise is that of a mean of so many ``samples`` of 1 ms.
        Force then moment about the tip's middle [N, N m], without the weight of the tip as
        described. What the tip's acceleration takes is in it, as in a real cell.
        """
        out = np.empty((3, 6))
        for i, tip in enumerate(self._tips):
            sent = tip.getBodyForce()
            R = np.asarray(tip.getWorldTransform().rotation())
            out[i, :3] = -sent[3:] + self._tip_weight[i] * R[2]
            out[i, 3:] = -sent[:3]
        out += self._bias + self._noise / math.sqrt(samples) * self._rng.standard_normal((3, 6))
        if self.setting.dead is not None:
            out[self.setting.dead] = self._bias[self.setting.dead]
        return out

    def palm(self) -> tuple[Array, Array]:
        """R_BH, shape (3, 3), and p_BH, shape (3,) [m]."""
        return transform(self._skeleton.getBodyNode(self.robot.hand.palm))

    def object(self) -> tuple[Array, Array]:
        """R_BX, shape (3, 3), and p_BX of the object's foot, shape (3,) [m]."""
        if self._object is None:
            return np.eye(3), np.array([*self.setting.place, self.setting.table.at[2]])
        return transform(self._object)

    def contacts(self) -> dict[str, Array]:
        """What touches the object or the table, by body of the robot: rows of point, force.

        Each value has shape (n, 6): point in B [m], force on the body of the robot in B [N].
        """
        found: dict[str, list[Array]] = {}
        for contact in self._world.getLastCollisionResult().getContacts():
            first = self._body_of(contact.collisionObject1.getShapeFrame())
            second = self._body_of(contact.collisionObject2.getShapeFrame())
            force = np.asarray(contact.force).reshape(3)
            point = np.asarray(contact.point).reshape(3)
            for body, other, sign in ((first, second, 1.0), (second, first, -1.0)):
                if body not in ("object", "table") and other in ("object", "table"):
                    found.setdefault(body, []).append(np.concatenate([point, sign * force]))
        return {body: np.array(rows) for body, rows in found.items()}

    def colliding(self) -> bool:
        """Whether the robot, as placed, overlaps the object or the table."""
        option = dart.collision.CollisionOption(True, 100, dart.collision.BodyNodeCollisionFilter())
        result = dart.collision.CollisionResult()
        self._world.checkCollision(option, result)
        for contact in result.getContacts():
            sides = (contact.collisionObject1, contact.collisionObject2)
            if {self._body_of(side.getShapeFrame()) for side in sides} != {"object", "table"}:
                return True
        return False

    # --- step -------------------------------------------------------------------------------

    def step(
        self,
        torque: Array,
        drive: Array | None = None,
        pushes: Sequence[tuple[str, Array]] = (),
        lift: float = 0.0,
    ) -> None:
        """Advance by one step.

        Args:
            torque: of the driven joints, shape (11,) [N m]; the motors clamp them.
            drive: force on the platform in W, shape (3,) [N, N, N m]; None: none.
            pushes: bodies by name, with a force in W, shape (3,) [N].
            lift: acceleration of the floor upwards [m/s^2].
        """
        self._forces[self._leaders] = np.clip(torque, -self._limit, self._limit)
        if drive is not None:
            self._forces[PLATFORM] = drive
            self._set_gravity(GRAVITY + lift)
        for name, force in pushes:
            body = self._object if name == "object" else self._skeleton.getBodyNode(name)
            body.addExtForce(force, body.getLocalCOM(), False, True)
        self._skeleton.setForces(self._forces)
        if self._skin is not None:
            self._skin.fit()
        if self._object is not None and not self.setting.fixed:
            extra = self.setting.mass * (self.gravity_on_object + [0.0, 0.0, GRAVITY]) + self.push
            if np.any(extra):
                self._object.addExtForce(extra, self._object.getLocalCOM(), False, True)
        self._world.step()
        self.time += self.setting.step

    def _body_of(self, frame: Any) -> str:
        return next((name for node, name in self._nodes if frame is node), "")

    def _covered(self, skeleton: Any) -> Skin:
        """Plates on the object's curved pieces, which only their tips touch."""
        assert self.thing is not None
        bodies = [
            body
            for index in range(self._world.getNumSkeletons())
            for body in self._world.getSkeleton(index).getBodyNodes()
        ]
        others = [body for body in bodies if body.getName() not in self.robot.hand.tips]
        collision_filter = self._world.getConstraintSolver().getCollisionOption().collisionFilter
        s = self.setting
        return Skin(self.thing, s.scale, skeleton, self._tips, others, collision_filter, s.friction)

    def _stand(self, skeleton: Any) -> None:
        R = Rotation.from_rotvec([0.0, 0.0, self.setting.yaw]).as_matrix()
        X = isometry(R, np.array([*self.setting.place, self.setting.table.at[2]]))
        if self.setting.fixed:
            skeleton.getJoint(0).setTransformFromParentBodyNode(X)
        else:
            skeleton.setPositions(dart.dynamics.FreeJoint.convertToPositions(X))

    def _differ(self, skeleton: Any) -> list[float]:
        """Draw what this run's robot differs in; returns the drives' Coulomb friction [N m]."""
        s = self.setting
        bodies = [b for b in skeleton.getBodyNodes() if b.getMass() > 0.01]
        for body in bodies:
            mass, moment = 1.0 + s.mismatch.inertia * self._rng.uniform(-1.0, 1.0, 2)
            old = body.getInertia()
            body.setInertia(
                dart.dynamics.Inertia(
                    old.getMass() * mass, old.getLocalCOM(), old.getMoment() * mass * moment
                )
            )
        arm, hand = self.robot.arm, self.robot.hand
        coulomb = []
        for values, on in (
            (arm.coulomb_friction, s.arm_friction),
            (hand.coulomb_friction, s.finger_friction),
        ):
            for value in values:
                drawn = value * (1.0 + s.mismatch.friction * self._rng.uniform(-1.0, 1.0))
                coulomb.append(drawn if on else 0.0)
        return coulomb
