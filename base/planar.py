"""Rotations of the plane, for poses and twists given as (x, y, heading)."""

from __future__ import annotations

import math

import numpy as np

from services.messages import Array


def rotate(heading: float, twist: Array) -> Array:
    """Express a twist or displacement given in a frame turned by ``heading`` in the outer frame.

    Args:
        heading: of the inner frame in the outer [rad]; negate it for the other way round.
        twist: (3,) x, y and an angle, which a turn of the plane leaves as it is.
    """
    c, s = math.cos(heading), math.sin(heading)
    x, y, angle = twist
    return np.array([c * x - s * y, s * x + c * y, angle])


def compose(outer: Array, inner: Array) -> Array:
    """X_AC from X_AB and X_BC, each (3,) [m, m, rad]; headings add without wrapping."""
    return outer + rotate(outer[2], inner)


def wrap(angle: float) -> float:
    """The same angle in -pi..pi [rad]."""
    return math.remainder(angle, 2 * math.pi)


def difference(goal: Array, pose: Array) -> Array:
    """What leads from ``pose`` to ``goal`` in their common frame, turning the short way round."""
    out = goal - pose
    out[2] = wrap(out[2])
    return out


def within(error: Array, tolerance: tuple[float, float], scale: float = 1.0) -> bool:
    """Whether an error (3,) is no larger than a tolerance, in place and in heading.

    Args:
        error: x, y [m] and heading [rad].
        tolerance: of x, y together [m] and of the heading [rad].
        scale: on both; who has arrived asks with more, so that noise does not make it set out.
    """
    near = math.hypot(error[0], error[1]) <= scale * tolerance[0]
    return near and bool(abs(error[2]) <= scale * tolerance[1])


def shorten(twist: Array, translation: float, turn: float) -> Array:
    """Limit the length of the translation and the size of the turn; directions stay."""
    length = math.hypot(twist[0], twist[1])
    scale = min(1.0, translation / length) if length > 0 else 1.0
    return np.array([scale * twist[0], scale * twist[1], max(-turn, min(turn, twist[2]))])
