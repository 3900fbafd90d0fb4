"""The composite grasp controller as it is printed: in angles of the surface (Eq 4.3 to 4.19).

For comparison only. Theta and phi parametrise the normal, o = (cos t cos p, sin t cos p, sin p) out
of the object. Two things are wrong with the printed Cartesian form, both right at phi = 0 alone:

- Eq 4.27 takes d psi / d x for (r_theta; r_phi); the row of theta lacks 1 / cos phi. ``corrected``
  puts it in.
- The projector of Eq 4.19 depends on the coordinates. In these the two gradients are not quite
  orthogonal, so that it takes away something, but only what the parametrisation made up.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arm.hand.residuals import ALPHA, R_C, Kind, blend, checked, residuals, step

Array = NDArray[np.float64]
POLE = 1e-3
"""Smallest cos phi that is divided by."""


def angles(normals: ArrayLike) -> Array:
    """Theta and phi of each contact (Eq 4.3), (k, 2) [rad]; normals into the object, (k, 3)."""
    o = -np.asarray(normals, dtype=float)
    return np.stack([np.arctan2(o[:, 1], o[:, 0]), np.arcsin(np.clip(o[:, 2], -1.0, 1.0))], axis=1)


def force(psi: Array) -> Array:
    """Unit force of contacts at the angles psi (k, 2) on a unit sphere (Eq 4.3), (k, 3)."""
    t, p = psi.T
    return -np.stack([np.cos(t) * np.cos(p), np.sin(t) * np.cos(p), np.sin(p)], axis=1)


def force_by_angles(psi: Array) -> Array:
    """Its derivative (Eq 4.4), (k, 3, 2)."""
    t, p = psi.T
    by_t = np.stack([np.sin(t) * np.cos(p), -np.cos(t) * np.cos(p), 0.0 * t], axis=1)
    by_p = np.stack([np.cos(t) * np.sin(p), np.sin(t) * np.sin(p), -np.cos(p)], axis=1)
    return np.stack([by_t, by_p], axis=2)


def moment_by_angles(psi: Array) -> Array:
    """Derivative of the moment by the place on the tangent plane (Eq 4.7), (k, 3, 2)."""
    t, p = psi.T
    by_t = np.stack([-np.cos(t) * np.sin(p), -np.sin(t) * np.sin(p), np.cos(p)], axis=1)
    by_p = np.stack([np.sin(t), -np.cos(t), 0.0 * t], axis=1)
    return np.stack([by_t, by_p], axis=2)


def tangents(psi: Array) -> Array:
    """Unit vectors along theta and phi on the tangent plane (Eq 4.27), (k, 2, 3)."""
    t, p = psi.T
    along_t = np.stack([-np.sin(t), np.cos(t), 0.0 * t], axis=1)
    along_p = np.stack([-np.cos(t) * np.sin(p), -np.sin(t) * np.sin(p), np.cos(p)], axis=1)
    return np.stack([along_t, along_p], axis=1)


def gradients(
    normals: ArrayLike, points: ArrayLike, r_c: float = R_C, corrected: bool = False
) -> tuple[Array, Array]:
    """Gradients of both errors in surface coordinates (Eq 4.13, 4.17), (k, 2) each.

    Args:
        normals: into the object, unit, (k, 3).
        points: of contact, in the same frame, (k, 3) [m].
        r_c: characteristic radius: the printed unit sphere, with a unit [m].
        corrected: the force's by metres along theta and phi over r_c, not by the angles.

    Raises:
        ValueError: shapes do not fit, or r_c is not positive.
    """
    n, x = checked(normals, points, r_c)
    rho, moment = residuals(n, x, r_c)
    psi = angles(n)
    g_force = 2.0 * np.einsum("j,kjc->kc", rho, force_by_angles(psi))
    g_moment = 2.0 * np.einsum("j,kjc->kc", moment, moment_by_angles(psi))
    if corrected:
        g_force[:, 0] /= np.maximum(np.cos(psi[:, 1]), POLE)
    return g_force, g_moment


def displacements(
    normals: ArrayLike,
    points: ArrayLike,
    r_c: float = R_C,
    alpha: float = ALPHA,
    kind: Kind = "null",
    corrected: bool = False,
    most: float = np.inf,
) -> Array:
    """How far each contact should slide now, as printed (Eq 4.19, 4.28 to 4.30), (k, 3) [m].

    Args:
        normals, points, r_c, corrected: as of ``gradients``.
        alpha, kind, most: as of ``arm.hand.residuals.displacements``.

    Raises:
        ValueError: shapes do not fit, r_c is not positive, or there is no such kind.
    """
    g_force, g_moment = gradients(normals, points, r_c, corrected)
    both = blend(g_force, g_moment, kind)
    along = tangents(angles(normals))
    return step(np.einsum("kc,kcj->kj", both, along), r_c, alpha, most)
