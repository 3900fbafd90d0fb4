"""Force and moment residual of a set of contacts, and how the contacts should slide to lose them.

A grasp is good where unit forces along all contact normals balance: rho = sum n_i = 0 and
M = sum (x_i - c) x n_i = 0 (Platt, "Grasp Control", Eq 4.1, 4.2, 4.11, 4.15). Nothing of the
object is known but points and normals, so the gradients take its surface for a sphere (force,
Eq 4.3 to 4.5) and for a plane (moment, Eq 4.6 to 4.8) around each contact. Here they are written
without coordinates of the surface, which the printed Cartesian form (Eq 4.28) is not:

    d rho.rho / dx_i = -2 (1 - n_i n_i^T) rho        d M.M / dx_i = 2 n_i x M

Conventions. Normals point *into* the object. Lengths are in units of a characteristic radius r_c:
M is divided by it, gradients are by x / r_c, steps are multiplied by it; the paper equates metres
with radians, which weighs the moment about twenty times too little. c is the centroid of the
contacts; it matters only while rho is not zero.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Kind = Literal["force", "moment", "sum", "null"]
KINDS: tuple[Kind, ...] = get_args(Kind)

R_C = 0.05
"""Characteristic radius unless another is known [m]: half the width that a hand grasps."""
ALPHA = 0.04
"""Step along the gradient; the surface's radius over r_c is the only scale it depends on."""


def residuals(normals: ArrayLike, points: ArrayLike, r_c: float = R_C) -> tuple[Array, Array]:
    """Net force and net moment of unit forces along the normals (Eq 4.11, 4.15).

    Args:
        normals: into the object, unit, (k, 3).
        points: of contact, in the same frame, (k, 3) [m].
        r_c: characteristic radius [m].

    Returns:
        rho (3,), and M about the centroid over r_c (3,); both without unit.

    Raises:
        ValueError: shapes do not fit, or r_c is not positive.
    """
    n, x = checked(normals, points, r_c)
    arms = (x - x.mean(axis=0)) / r_c
    return n.sum(axis=0), cross(arms, n).sum(axis=0)


def errors(normals: ArrayLike, points: ArrayLike, r_c: float = R_C) -> tuple[float, float]:
    """The squares rho.rho and M.M that are descended (Eq 4.1, 4.2); see ``residuals``."""
    rho, moment = residuals(normals, points, r_c)
    return float(rho @ rho), float(moment @ moment)


def force_gradient(normals: ArrayLike, rho: ArrayLike) -> Array:
    """Gradient of rho.rho by each x_i / r_c on a sphere of radius r_c (Eq 4.5), (k, 3).

    Args:
        normals: into the object, unit, (k, 3).
        rho: net force, (3,).
    """
    n, rho = np.asarray(normals, dtype=float), np.asarray(rho, dtype=float)
    return -2.0 * (rho - n * (n @ rho)[:, None])


def moment_gradient(normals: ArrayLike, moment: ArrayLike) -> Array:
    """Gradient of M.M by each x_i / r_c on a plane (Eq 4.8), (k, 3).

    Args:
        normals: into the object, unit, (k, 3).
        moment: net moment over r_c, (3,).
    """
    return 2.0 * cross(np.asarray(normals, dtype=float), np.asarray(moment, dtype=float))


def gradients(normals: ArrayLike, points: ArrayLike, r_c: float = R_C) -> tuple[Array, Array]:
    """Both gradients, (k, 3) each; tangent to the surface at each contact. See ``residuals``."""
    rho, moment = residuals(normals, points, r_c)
    return force_gradient(normals, rho), moment_gradient(normals, moment)


def displacements(
    normals: ArrayLike,
    points: ArrayLike,
    r_c: float = R_C,
    alpha: float = ALPHA,
    kind: Kind = "sum",
    most: float = np.inf,
) -> Array:
    """How far each contact should slide now: down the gradients.

    Args:
        normals: into the object, unit, (k, 3).
        points: of contact, in the same frame, (k, 3) [m].
        r_c: characteristic radius [m].
        alpha: step.
        kind: ``force``, ``moment``, their ``sum``, or ``null``, the moment's projected into the
            null space of the force's (Eq 4.19). On what these gradients assume the last two are
            the same: g_f . g_m = 4 rho . (sum n_i x M) = 4 rho . (rho x M) = 0, so that the
            projector does nothing. ``curvature`` has a null space that does.
        most: longest displacement; all are shortened alike to keep to it [m].

    Returns:
        Displacements, tangent to the surface, (k, 3) [m].

    Raises:
        ValueError: shapes do not fit, r_c is not positive, or there is no such kind.
    """
    g_force, g_moment = gradients(normals, points, r_c)
    return step(blend(g_force, g_moment, kind), r_c, alpha, most)


def blend(g_force: Array, g_moment: Array, kind: Kind) -> Array:
    """One gradient of two by the kind of controller, (k, 3).

    Raises:
        ValueError: there is no such kind.
    """
    if kind == "force":
        return g_force
    if kind == "moment":
        return g_moment
    if kind == "sum":
        return g_force + g_moment
    if kind == "null":
        return g_force + project_out(g_force, g_moment)
    raise ValueError(f"unknown kind {kind!r}; there are {', '.join(KINDS)}")


def project_out(row: Array, other: Array, damping: float = 1e-6) -> Array:
    """``other`` without its part along ``row`` (N of Eq 4.19), both as one long vector.

    Args:
        row: gradient of higher priority, any shape.
        other: of the same shape.
        damping: near a zero of ``row`` the projector fades into the identity, as the objective
            does not ask for anything there (Platt et al., Eq 4 of the refinement paper).
    """
    return other - row * (np.sum(row * other) / (np.sum(row * row) + damping**2))


def step(gradient: Array, r_c: float, alpha: float, most: float) -> Array:
    """Displacements down a gradient by x / r_c, none longer than ``most`` [m]."""
    dx = -alpha * r_c * gradient
    longest = float(np.linalg.norm(dx, axis=1).max(initial=0.0))
    return dx * (most / longest) if longest > most else dx


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors (..., 3); as numpy's, without what makes that slow on few."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    out: Array = np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
    return out


def checked(normals: ArrayLike, points: ArrayLike, r_c: float) -> tuple[Array, Array]:
    """Normals and points as arrays.

    Raises:
        ValueError: shapes do not fit, or r_c is not positive.
    """
    n, x = np.asarray(normals, dtype=float), np.asarray(points, dtype=float)
    if n.ndim != 2 or n.shape[1] != 3 or n.shape != x.shape or not len(n):
        raise ValueError(f"normals and points are (k, 3) with k > 0, not {n.shape} and {x.shape}")
    if not r_c > 0.0:
        raise ValueError(f"a characteristic radius is positive, not {r_c}")
    return n, x


class Sequential:
    """C*: the force residual to convergence, only then the moment residual (section 4.1.4).

    As Coelho states it: it does not go back to the force if the moment made it worse again,
    unless ``fallback``, a departure, is asked for.

    Args:
        tolerance: |rho| at which the force counts as converged.
        fallback: go back to the force whenever |rho| exceeds three times the tolerance.
    """

    def __init__(self, tolerance: float = 0.05, fallback: bool = False) -> None:
        self.tolerance, self.fallback = tolerance, fallback
        self.kind: Literal["force", "moment"] = "force"

    def choose(self, rho: ArrayLike) -> Kind:
        """Which residual to descend now, given the net force (3,)."""
        size = float(np.linalg.norm(np.asarray(rho, dtype=float)))
        if size < self.tolerance:
            self.kind = "moment"
        elif self.fallback and size > 3.0 * self.tolerance:
            self.kind = "force"
        return self.kind
