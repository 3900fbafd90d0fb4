"""A null space that is real: the moment descends where the measured surface keeps the force.

On the sphere and plane that the paper assumes, Eq 4.19 projects nothing away. What the moment's
motion does to the net force depends on how the object is curved, and a finger that slides feels
that: over a short way dx its normal turns by dn = -S dx, S the shape operator. ``Curvature``
estimates S of one contact from such pairs. With it the change of the net force is known,
d rho = sum -S_i dx_i, and the moment is descended in the null space of that matrix of three rows:
all of rho is kept to first order, not only its length. The gradients themselves stay those of
sphere and plane: with the measured curvature in them too, fewer grasps converged.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arm.hand.residuals import (
    ALPHA,
    R_C,
    checked,
    cross,
    force_gradient,
    moment_gradient,
    residuals,
    step,
)

Array = NDArray[np.float64]


class Curvature:
    """The shape operator of the surface under one contact, from how its normal turned.

    Weighted least squares over (dx, dn) with forgetting by distance, towards a plane where nothing
    was felt yet: what is not known holds nothing back, and once it moves it is known. (Taken for a
    sphere it would hold back for ever what it never feels.) The point is whatever slides: for a
    spherical tip its centre is best, which moves on a surface nowhere sharper than the tip.

    Args:
        r_c: characteristic radius; with ``noise`` it says how far apart pairs must be [m].
        memory: way after which a pair counts 1/e [m].
        noise: standard deviation of a normal [rad]; pairs are taken no closer together than shows
            against it.
        sharpest: largest curvature believed [1/m].
    """

    def __init__(
        self,
        r_c: float = R_C,
        memory: float = 0.015,
        noise: float = 0.0,
        sharpest: float = 200.0,
    ) -> None:
        self.memory, self.sharpest = memory, sharpest
        self.shortest = max(1e-5, noise * r_c)
        self._prior = 0.001 + self.shortest  # as if over this way a plane had been felt [m]
        self._last: tuple[Array, Array] | None = None
        self._frame = np.zeros((2, 3))
        self._a = np.zeros((3, 3))
        self._b = np.zeros(3)

    def feel(self, normal: ArrayLike, point: ArrayLike) -> None:
        """Take in where the contact is now: unit normal into the object (3,), point (3,) [m]."""
        n, x = np.array(normal, dtype=float), np.array(point, dtype=float)  # kept: no views
        if self._last is None:
            self._last, self._frame = (n, x), _frame(n, np.eye(3)[np.argmin(np.abs(n))])
            return
        dx = x - self._last[1]
        way = float(np.linalg.norm(dx))
        if way < self.shortest:
            return
        middle = n + self._last[0]
        self._frame = _frame(middle / np.linalg.norm(middle), self._frame[0])
        (u, v), (p, q) = self._frame @ dx, -self._frame @ (n - self._last[0])
        rows = np.array([[u, v, 0.0], [0.0, u, v]])  # of S = [[a, b], [b, c]]
        keep = np.exp(-way / self.memory)
        # over the way: a metre felt in many pairs counts as one felt in few
        self._a = keep * self._a + rows.T @ rows / way
        self._b = keep * self._b + rows.T @ np.array([p, q]) / way
        self._last = (n, x)

    def estimate(self) -> Array:
        """S in the frame of points and normals, (3, 3) [1/m]; zero along the normal."""
        if self._last is None:
            raise ValueError("nothing was felt yet")
        weight = self._prior * np.diag([1.0, 2.0, 1.0])
        a, b, c = np.linalg.solve(self._a + weight, self._b)
        values, vectors = np.linalg.eigh(np.array([[a, b], [b, c]]))
        axes = vectors.T @ _frame(self._last[0], self._frame[0])
        return (axes.T * np.clip(values, -self.sharpest, self.sharpest)) @ axes


def displacements(
    normals: ArrayLike,
    points: ArrayLike,
    shapes: Sequence[Array],
    r_c: float = R_C,
    alpha: float = ALPHA,
    most: float = np.inf,
    damping: float = 0.1,
) -> Array:
    """How far each contact should slide now, the moment in the real null space of the force.

    Args:
        normals: into the object, unit, (k, 3).
        points: of contact, in the same frame, (k, 3) [m].
        shapes: shape operator at each contact, (3, 3) [1/m].
        r_c, alpha, most: as of ``arm.hand.residuals.displacements``.
        damping: curvature times r_c below which a surface counts as flat and holds nothing back.

    Raises:
        ValueError: shapes of the arrays do not fit, or r_c is not positive.
    """
    n, x = checked(normals, points, r_c)
    if len(shapes) != len(n):
        raise ValueError(f"{len(n)} contacts, {len(shapes)} shape operators")
    rho, moment = residuals(n, x, r_c)
    rows = -r_c * np.hstack(list(shapes))
    down = moment_gradient(n, moment).ravel()
    held = rows.T @ np.linalg.solve(rows @ rows.T + damping**2 * np.eye(3), rows @ down)
    return step(force_gradient(n, rho) + (down - held).reshape(-1, 3), r_c, alpha, most)


def _frame(normal: Array, near: Array) -> Array:
    first = near - normal * (normal @ near)
    first /= np.linalg.norm(first)
    return np.stack([first, cross(normal, first)])
