"""The frames a node may work in: the board's, the ground's, the platform's."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from arm.nodes.node import Array, Context

FRAMES = ("board", "ground", "platform")
"""S, O and B: the last one moves."""


@dataclass(slots=True, eq=False)
class Frame:
    """A frame F as seen from the ground O, at one instant.

    Attributes:
        R: R_OF, shape (3, 3).
        p: p_OF, shape (3,) [m].
        v: velocity of its origin in O, shape (3,) [m/s].
        turn: its rate about the vertical [rad/s].
    """

    R: Array
    p: Array
    v: Array
    turn: float = 0.0

    def to_ground(self, point: Array, velocity: Array) -> tuple[Array, Array]:
        """Position p_OP [m] and velocity [m/s] in O of a point given in F, shapes (3,)."""
        arm = self.R.dot(point)
        moved = self.v + self.R.dot(velocity)
        if self.turn:
            moved += np.array([-self.turn * arm[1], self.turn * arm[0], 0.0])
        return self.p + arm, moved

    def from_ground(self, point: Array) -> Array:
        """A point given in O, in F [m]."""
        return self.R.T.dot(point - self.p)


def frame_of(name: str, context: Context) -> Frame:
    """One of ``FRAMES``, as the context has it."""
    still = np.zeros(3)
    if name == "board":
        return Frame(context.R_OS, context.p_OS, still)
    if name == "ground":
        return Frame(np.eye(3), still, still)
    x, y, heading = context.base.pose
    vx, vy, turn = context.base.velocity
    c, s = math.cos(heading), math.sin(heading)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return Frame(R, np.array([x, y, 0.0]), np.array([vx, vy, 0.0]), float(turn))


def to_board(context: Context, p_O: Array, v_O: Array) -> tuple[Array, Array]:
    """A point [m] and its velocity [m/s] given in O, in the board's frame S, shapes (3,)."""
    R_SO = context.R_OS.T
    return R_SO.dot(p_O - context.p_OS), R_SO.dot(v_O)


def pointing(heading: float, elevation: float) -> Array:
    """R_FT of a pen along ``heading`` [rad] from x_F, ``elevation`` [rad] above level; x_T down."""
    ch, sh = math.cos(heading), math.sin(heading)
    ce, se = math.cos(elevation), math.sin(elevation)
    z = np.array([ce * ch, ce * sh, se])
    x = np.array([se * ch, se * sh, -ce])
    return np.column_stack([x, np.cross(z, x), z])


def about(axis: Array, angle: float) -> Array:
    """Rotation matrix of ``angle`` [rad] about a unit vector, shape (3, 3)."""
    x, y, z = axis.tolist()
    s, c = math.sin(angle), math.cos(angle)
    u = 1.0 - c
    return np.array(
        [
            [c + u * x * x, u * x * y - s * z, u * x * z + s * y],
            [u * x * y + s * z, c + u * y * y, u * y * z - s * x],
            [u * x * z - s * y, u * y * z + s * x, c + u * z * z],
        ]
    )


def axis_angle(R: Array) -> tuple[Array, float]:
    """Unit axis, shape (3,), and angle in 0 .. pi [rad] of a rotation matrix."""
    w = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = float(np.linalg.norm(w)), 0.5 * (float(np.trace(R)) - 1.0)
    angle = math.atan2(sine, cosine)
    if sine > 1e-9:
        return w / sine, angle
    if cosine > 0.0:
        return np.array([0.0, 0.0, 1.0]), 0.0
    i = int(np.argmax(np.diagonal(R)))  # half a turn: R = 2 a a^T - 1
    axis = 0.5 * (R[:, i] + np.eye(3)[:, i])
    return axis / np.linalg.norm(axis), angle
