"""Gravity as a contact, and the grasp controller that turns an object against it (section 4.4.2).

Gravity presses at the centre of mass with a unit force down (Eq 4.35, 4.37). It takes part in the
residuals but cannot be moved. With a hand that holds the object, the residual is lost by turning
hand and object together (Eq 4.38 to 4.41) rather than by sliding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arm.hand.residuals import (
    ALPHA,
    R_C,
    Kind,
    blend,
    checked,
    cross,
    force_gradient,
    moment_gradient,
    residuals,
    step,
)

Array = NDArray[np.float64]
DOWN = np.array([0.0, 0.0, -1.0])


def with_gravity(
    normals: ArrayLike, points: ArrayLike, centre: ArrayLike, r_c: float = R_C
) -> tuple[Array, Array]:
    """The contacts and, last, gravity (Eq 4.35, 4.37): normals and points, (k + 1, 3) each.

    Args:
        normals: into the object, unit, in a frame with z up, (k, 3).
        points: of contact, in the same frame, (k, 3) [m].
        centre: of mass, (3,) [m].
        r_c: checked as everywhere [m].

    Raises:
        ValueError: shapes do not fit.
    """
    n, x = checked(normals, points, r_c)
    return np.vstack([n, DOWN]), np.vstack([x, np.asarray(centre, dtype=float)])


def displacements(
    normals: ArrayLike,
    points: ArrayLike,
    centre: ArrayLike,
    r_c: float = R_C,
    alpha: float = ALPHA,
    kind: Kind = "sum",
    most: float = np.inf,
) -> Array:
    """How far the contacts should slide to oppose gravity too, (k, 3) [m].

    Gravity is in the sensor's resources, not in the effector's: its row is computed with, and left
    out of the answer. Arguments as of ``with_gravity`` and ``residuals.displacements``.
    """
    n, x = with_gravity(normals, points, centre, r_c)
    rho, moment = residuals(n, x, r_c)
    g_force, g_moment = force_gradient(n[:-1], rho), moment_gradient(n[:-1], moment)
    return step(blend(g_force, g_moment, kind), r_c, alpha, most)


def rotation(
    normals: ArrayLike,
    points: ArrayLike,
    centre: ArrayLike | None,
    r_c: float = R_C,
    alpha: float = ALPHA,
    kind: Kind = "sum",
) -> Array:
    """How far hand and object should turn now, down the gradients (Eq 4.38 to 4.41).

    About the contacts' centroid, which stays: what moves against gravity is the centre of mass.
    The printed Eq 4.39 differentiates the moment by the contact's own rotation, which moves
    nothing. Without gravity all turns together and nothing changes: the answer is zero.

    Args:
        normals: into the object, unit, in a frame with z up, (k, 3).
        points: of contact, fixed to the object, in the same frame, (k, 3) [m].
        centre: of mass, (3,) [m]; None leaves gravity out of the residuals.
        r_c, alpha, kind: as of ``residuals.displacements``.

    Returns:
        Axis times angle, (3,) [rad].

    Raises:
        ValueError: shapes do not fit, or there is no such kind.
    """
    n, x = checked(normals, points, r_c)
    middle = x.mean(axis=0)
    rho = n.sum(axis=0)
    held = cross((x - middle) / r_c, n).sum(axis=0)
    if centre is None:
        arm, down = np.zeros(3), np.zeros(3)
    else:
        arm, down = (np.asarray(centre, dtype=float) - middle) / r_c, DOWN
    net, moment = rho + down, held + cross(arm, down)
    g_force = 2.0 * cross(rho, net)
    g_moment = 2.0 * (cross(held, moment) + cross(arm, cross(down, moment)))
    turn: Array = -alpha * blend(g_force, g_moment, kind)
    return turn
