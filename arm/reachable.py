"""Whether the arm reaches what a program's nodes are to draw, asked before anything moves."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from arm.hds import Program
from arm.joint_limits import JOINT_MARGIN
from arm.model import ArmModel, Base
from arm.nodes import build
from arm.nodes.drive_to import DriveTo
from arm.nodes.node import TOOL_ON_BOARD, Array
from deploy.task import BoardPose

COARSE = 0.01
"""The joints are solved for points this far apart [m]."""
CLOSE = 1e-4
"""A solution is this near [m, rad]."""


@runtime_checkable
class Planned(Protocol):
    """A node whose points are known before it runs.

    Attributes:
        margin: reach that must be left at each [m].
    """

    margin: float

    def points(self) -> Array:
        """Every point, p_ST_S, shape (n, 3) [m]."""
        ...


class Reachability:
    """Looks at programs with a model of its own.

    Args:
        robot: name of the robot's folder in deploy/robots.
        board: where the board is believed to be, X_OS.
    """

    def __init__(self, robot: str, board: BoardPose) -> None:
        self._robot = robot
        self._R, self._p = board.rotation(), board.position()

    @cached_property
    def _model(self) -> ArmModel:
        return ArmModel(self._robot)  # slow, and few programs need it

    @property
    def _rest(self) -> Array:
        return np.array(self._model.robot.arm.rest)

    def refuse(self, program: Program, pose: Array) -> None:
        """Check every node whose points are known.

        The platform counts as where it is, or at any goal the program has for it; ``Margin`` of
        the node is what it may move beside that.

        Args:
            program: checked.
            pose: X_OB of the platform now: x, y [m], heading [rad].

        Raises:
            ValueError: a point is out of reach; names the node and the worst point.
        """
        controls = {
            name: build(node, program) for name, node in program.nodes.items() if not node.terminal
        }
        poses = [pose, *(c.goal for c in controls.values() if isinstance(c, DriveTo))]
        for name, control in controls.items():
            if isinstance(control, Planned):
                found = [self.worst(control.points(), at, control.margin) for at in poses]
                if all(found):
                    raise ValueError(f"node {name}: {found[0]}")

    def worst(self, points: Array, pose: Array, margin: float) -> str:
        """What is wrong with the worst of the points, empty if all are reached.

        Args:
            points: p_ST_S in the order in which they come, shape (n, 3) [m].
            pose: X_OB of the platform.
            margin: reach that must be left [m].
        """
        base = Base(np.asarray(pose, dtype=float), np.zeros(3), np.zeros(3))
        left = self._reach_left(points, base)
        i = int(left.argmin())
        if left[i] < margin:
            short = int((left < margin).sum())
            where = f"{short} of {len(points)} points are out of reach"
            return (
                f"{where}; the worst is {_place(points[i])}, where {_reach(left[i])} of the arm's "
                f"reach and {1e3 * margin:.0f} mm must be left"
            )
        steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
        s = np.concatenate([[0.0], np.cumsum(steps)])
        marks = np.unique(np.searchsorted(s, np.arange(0.0, s[-1] + COARSE, COARSE)))
        coarse = points[np.minimum(marks, len(points) - 1)]
        return self._joints(coarse, base)

    def _reach_left(self, points: Array, base: Base) -> Array:
        """Distance left before the arm is stretched out [m], shape (n,)."""
        at = self._model.place(base, self._rest, np.zeros(self._model.joints))
        wrist, shoulder = self._model.wrist_and_shoulder()
        offset = self._R @ TOOL_ON_BOARD @ at.R.T @ (wrist - at.p)
        wrists = self._p + points @ self._R.T + offset
        stretch = np.linalg.norm(wrists - shoulder, axis=1)
        return np.asarray(self._model.robot.arm.reach - stretch)

    def _joints(self, points: Array, base: Base) -> str:
        """Follow the points with the joints, from the pose of rest."""
        q = self._rest.copy()
        first = self._R.T @ (self._model.place(base, q, np.zeros(self._model.joints)).p - self._p)
        way = first + np.linspace(0.0, 1.0, 20)[:, None] * (points[0] - first)
        worst, where = np.inf, points[0]
        for n, point in enumerate(np.concatenate([way, points])):
            q, error = self._solve(q, point, base)
            if n < len(way):
                continue
            margin = self._model.joint_margin(q) if error < CLOSE else -np.inf
            if margin < worst:
                worst, where = margin, point
        if worst >= JOINT_MARGIN:
            return ""
        if np.isinf(worst):
            return f"no pose of the joints reaches the point {_place(where)}"
        return (
            f"the worst point is {_place(where)}, where a joint is {worst:.2f} rad from its limit "
            f"and {JOINT_MARGIN:g} rad must be left"
        )

    def _solve(self, q: Array, point: Array, base: Base) -> tuple[Array, float]:
        """Joints that put a square pen on a point, from a guess; and what is left of the error."""
        target, R_OT = self._p + self._R @ point, self._R @ TOOL_ON_BOARD
        size = np.inf
        for _ in range(15):
            k = self._model.place(base, q, np.zeros(self._model.joints))
            turn = k.R @ R_OT.T
            about = np.array(
                [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
            )
            error = np.concatenate([target - k.p, -0.5 * about])
            size = float(np.abs(error).max())
            if size < 0.1 * CLOSE:
                break
            wanted = error
            if self._model.joints > 6:  # as the executive draws the joint to spare
                spare = self._rest - q
                wanted = error - k.J @ spare
            step = k.J.T @ np.linalg.solve(k.J @ k.J.T + 1e-6 * np.eye(6), wanted)
            if self._model.joints > 6:
                step += spare
            q = q + np.clip(step, -0.2, 0.2)
        return q, size


def _place(point: Array) -> str:
    return f"x = {1e3 * point[0]:.0f} mm, y = {1e3 * point[1]:.0f} mm on the board"


def _reach(left: float) -> str:
    return f"{-1e3 * left:.0f} mm are missing" if left < 0 else f"{1e3 * left:.0f} mm are left"
