"""How good a set of contacts is as a grasp: Ferrari and Canny's epsilon, 0 without force closure.

It does not follow from the residuals of ``residuals``, so it is reported beside them: three
contacts with zero residual are force closure with any friction (Ponce), but a cap and two opposed
sides are force closure at friction 0.5 with |rho| = 1.

Epsilon is the radius of the largest ball around the origin inside the convex hull of all wrenches
that contacts can apply with normal forces that sum to one (L1; Ferrari and Canny, "Planning
optimal grasps", 1992). Friction cones are pyramids of ``edges`` edges. Moments are about the
contacts' centroid, over r_c, so that all six components are forces. A soft finger also twists:
the two wrenches of its normal force with a moment of +-``torsion`` along it are added.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull, QhullError

from arm.hand.residuals import R_C, checked

Array = NDArray[np.float64]


def wrenches(
    normals: ArrayLike,
    points: ArrayLike,
    friction: float,
    r_c: float = R_C,
    edges: int = 8,
    torsion: float = 0.0,
) -> Array:
    """The wrenches at the edges of all friction cones, normal force 1.

    Args:
        normals: into the object, unit, (k, 3).
        points: of contact, in the same frame, (k, 3) [m].
        friction: coefficient, 0 or more.
        r_c: by which moments are divided [m].
        edges: of a cone, 3 or more.
        torsion: moment about its normal that a soft finger bears per normal force [m], about two
            thirds of friction times the radius of its patch; 0 is a hard finger.

    Returns:
        Force then moment about the centroid over r_c, (k * edges [+ 2 k], 6).

    Raises:
        ValueError: shapes do not fit, or a number is out of range.
    """
    n, x = checked(normals, points, r_c)
    if not friction >= 0.0 or not torsion >= 0.0 or edges < 3:
        raise ValueError(f"friction {friction}, torsion {torsion} >= 0 and edges {edges} >= 3")
    first, second = tangents(n)
    turn = 2.0 * np.pi * np.arange(edges) / edges
    around = (
        np.cos(turn)[None, :, None] * first[:, None, :]
        + np.sin(turn)[None, :, None] * second[:, None, :]
    )
    forces = n[:, None, :] + friction * around
    arms = ((x - x.mean(axis=0)) / r_c)[:, None, :]
    out = [np.concatenate([forces, np.cross(arms, forces)], axis=2).reshape(-1, 6)]
    if torsion > 0.0:
        straight = np.cross(arms[:, 0], n)
        twist = torsion / r_c * n
        out += [np.hstack([n, straight + twist]), np.hstack([n, straight - twist])]
    return np.concatenate(out)


def epsilon(
    normals: ArrayLike,
    points: ArrayLike,
    friction: float,
    r_c: float = R_C,
    edges: int = 8,
    torsion: float = 0.0,
) -> float:
    """Ferrari and Canny's quality: the worst wrench resisted per unit of normal force.

    Args:
        normals, points, friction, r_c, edges, torsion: as of ``wrenches``.

    Returns:
        0 if the grasp is not force closure.

    Raises:
        ValueError: as ``wrenches``.
    """
    corners = wrenches(normals, points, friction, r_c, edges, torsion)
    # a flat set has no inside: two hard contacts cannot resist a twist about their line
    if np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False)[-1] < 1e-9:
        return 0.0
    try:
        hull = ConvexHull(corners)
    except QhullError:
        return 0.0
    return max(0.0, float(-hull.equations[:, -1].max()))


def tangents(normals: Array) -> tuple[Array, Array]:
    """Two unit vectors across each normal and each other, (k, 3) each."""
    small = np.argmin(np.abs(normals), axis=1)
    first = np.cross(normals, np.eye(3)[small])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)
