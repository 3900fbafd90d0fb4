"""What a robot looks like: the shapes of its DART description, so picture and physics agree."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.robot import Robot, TwoArmRobot, robot_kind
from deploy.skeleton import ARM, BOTH, PLATFORM, load_skeleton, load_two_arm_skeleton

Array = NDArray[np.float64]
Pose = tuple[Array, Array]
"""Unit quaternion w, x, y, z, shape (4,), and position, shape (3,) [m]."""


@dataclass(frozen=True)
class Shape:
    """One thing to draw, fixed to a body.

    Attributes:
        body: name of the body.
        kind: what it is; anything else than these comes as its bounding box.
        size: of a box its edges, of a cylinder radius and length, of a sphere its radius [m].
        pose: in the body's frame.
    """

    body: str
    kind: Literal["box", "cylinder", "sphere"]
    size: tuple[float, ...]
    pose: Pose


class Model:
    """A robot's shapes, and where its bodies are for given joint positions.

    Args:
        name: of a folder in deploy/robots.

    Attributes:
        robot: its description.
        rest: joint positions before any were heard, shape (joints,) [rad].
        shapes: of all bodies that have any.
        bodies: their names.

    Raises:
        BadFile: no such robot, or one without arms.
    """

    def __init__(self, name: str) -> None:
        self.robot: Robot | TwoArmRobot
        if robot_kind(name) == "two_arm":
            robot, self._skeleton = load_two_arm_skeleton(name)
            self.robot, self._dofs, self.rest = robot, BOTH, np.array(robot.arms.rest)
        else:
            one, self._skeleton = load_skeleton(name)
            self.robot, self._dofs, self.rest = one, ARM, np.array(one.arm.rest)
        self._q = np.zeros(self._skeleton.getNumDofs())
        self._q[self._dofs] = self.rest
        self.shapes = list(_shapes(self._skeleton))
        drawn = {shape.body for shape in self.shapes}
        self._bodies = [b for b in self._skeleton.getBodyNodes() if b.getName() in drawn]
        self.bodies = tuple(body.getName() for body in self._bodies)

    def place(self, pose: Array, q: Array) -> dict[str, Pose]:
        """Where its bodies are.

        Args:
            pose: of the platform: x, y [m], heading [rad].
            q: joint positions, shape (joints,) [rad]; of another length they are left as they were.

        Returns:
            Body to pose in the frame of ``pose``.
        """
        self._q[PLATFORM] = pose
        if q.shape == self.rest.shape:
            self._q[self._dofs] = q
        self._skeleton.setPositions(self._q)
        return {body.getName(): _pose(body.getTransform()) for body in self._bodies}


def _shapes(skeleton: Any) -> Iterator[Shape]:
    for body in skeleton.getBodyNodes():
        for node in body.getShapeNodes():
            if node.hasVisualAspect():
                yield _shape(body.getName(), node)


def _shape(body: str, node: Any) -> Shape:
    shape = node.getShape()
    pose = _pose(node.getRelativeTransform())
    kind = shape.getType()
    if kind == "BoxShape":
        return Shape(body, "box", tuple(np.asarray(shape.getSize()).reshape(3).tolist()), pose)
    if kind == "CylinderShape":
        return Shape(body, "cylinder", (shape.getRadius(), shape.getHeight()), pose)
    if kind == "SphereShape":
        return Shape(body, "sphere", (shape.getRadius(),), pose)
    around = shape.getBoundingBox()
    low, high = (np.asarray(end).reshape(3) for end in (around.getMin(), around.getMax()))
    wxyz, p = pose
    turned = Rotation.from_quat(wxyz, scalar_first=True).apply((low + high) / 2)
    return Shape(body, "box", tuple((high - low).tolist()), (wxyz, p + turned))


def _pose(transform: Any) -> Pose:
    R = np.asarray(transform.rotation())
    wxyz = Rotation.from_matrix(R).as_quat(scalar_first=True)
    return wxyz, np.asarray(transform.translation()).reshape(3).copy()
