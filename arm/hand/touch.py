"""Where a spherical fingertip touches, from the load cell in it alone.

Bicchi, Salisbury and Brock ("Contact sensing from force measurements", 1993) for a soft finger on
a sphere: force f and moment m on the tip about its centre obey m = c x f + K c, where c is the
point of contact and K c the friction's spin. With |c| = R that is a quadratic in K^2, and c
follows in closed form. The normal c / R does not depend on friction along the surface: that force
is in f, and so is its moment in m. Signs: c / R points out of the tip, hence *into* the object;
it is the direction of the force on the object, the normal that ``residuals`` takes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def contact_from_wrench(f: ArrayLike, m: ArrayLike, radius: float) -> tuple[Array, Array]:
    """Point and normal of the contact that explains a wrench.

    Args:
        f: force on the tip, in any frame, (3,) or (..., 3) [N].
        m: moment on the tip about the centre of its sphere, in the same frame [N m].
        radius: of the tip [m].

    Returns:
        Point of contact from the centre [m], and the unit normal out of the tip (into the object),
        each of the shape of f.

    Raises:
        ValueError: the radius is not positive, a number is not finite, or a force is zero.
    """
    f, m = np.asarray(f, dtype=float), np.asarray(m, dtype=float)
    if not radius > 0.0:
        raise ValueError(f"the radius of a tip is positive, not {radius}")
    if not (np.isfinite(f).all() and np.isfinite(m).all()):
        raise ValueError("force and moment must be finite")
    ff = np.sum(f * f, axis=-1, keepdims=True)
    if (ff == 0.0).any():
        raise ValueError("no force, no contact")
    fm = np.sum(f * m, axis=-1, keepdims=True)
    a = np.sum(m * m, axis=-1, keepdims=True) - radius**2 * ff
    root = np.sqrt(a * a + 4.0 * radius**2 * fm * fm)
    # of both ways to write a root of the quadratic the one that does not cancel: exact also
    # where there is no spin, so that it needs no case of its own
    below = a < 0.0
    k = -np.where(fm < 0.0, -1.0, 1.0) * np.where(
        below,
        np.abs(fm) * np.sqrt(2.0 / np.where(below, root - a, 1.0)),
        np.sqrt(np.maximum(root + a, 0.0) / 2.0) / radius,
    )
    # f.m / K; towards the side that f presses on, since a contact cannot pull
    along = -np.where(
        below,
        np.sqrt(np.maximum(root - a, 0.0) / 2.0),
        np.abs(fm) / np.where(k == 0.0, 1.0, np.abs(k)),
    )
    c = (k * m + np.cross(f, m) + f * along) / (k * k + ff)
    n = c / np.maximum(np.linalg.norm(c, axis=-1, keepdims=True), 1e-300)
    return radius * n, n


@dataclass(frozen=True)
class Tare:
    """What a load cell reads without a contact: its bias, and the weight of the tip.

    Attributes:
        force, moment: bias, (3,) each [N], [N m].
        mass: of the tip, 0 if it was not found [kg].
        first_moment: mass times centre of mass from the tip's centre, (3,) [kg m].
        deviation: of single readings from this, of force and of moment [N], [N m].
    """

    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    mass: float = 0.0
    first_moment: Array = field(default_factory=lambda: np.zeros(3))
    deviation: tuple[float, float] = (0.0, 0.0)

    def net(self, wrench: ArrayLike, gravity: ArrayLike | None = None) -> tuple[Array, Array]:
        """Force and moment of the contact.

        Args:
            wrench: as read, force then moment about the tip's centre, in its frame, (6,).
            gravity: in the tip's frame, (3,) [m/s^2]; left out, the hand is as it was tared.
        """
        wrench = np.asarray(wrench, dtype=float)
        g = np.zeros(3) if gravity is None else np.asarray(gravity, dtype=float)
        force = wrench[:3] - self.force - self.mass * g
        return force, wrench[3:] - self.moment - np.cross(self.first_moment, g)


def tare(wrenches: ArrayLike, gravity: ArrayLike | None = None) -> Tare:
    """Learn what a load cell reads without a contact.

    One posture of the hand tells the bias together with the weight as it hangs there; several, with
    gravity known, tell them apart. Mass and first moment stay 0 unless the directions of gravity
    differ enough to find them (a quarter of g between two).

    Args:
        wrenches: readings, force then moment about the tip's centre, (n, 6).
        gravity: in the tip's frame at each reading, (n, 3) [m/s^2].

    Raises:
        ValueError: no readings, a wrong shape, or numbers that are not finite.
    """
    w = np.atleast_2d(np.asarray(wrenches, dtype=float))
    if w.ndim != 2 or w.shape[1] != 6 or not len(w) or not np.isfinite(w).all():
        raise ValueError(f"readings are finite and (n, 6) with n > 0, not {w.shape}")
    bias, mass, first = w.mean(axis=0), 0.0, np.zeros(3)
    left = w - bias
    if gravity is not None:
        g = np.asarray(gravity, dtype=float)
        if g.shape != (len(w), 3):
            raise ValueError(f"gravity is {(len(w), 3)}, not {g.shape}")
        dg = g - g.mean(axis=0)
        if np.abs(dg).max() > 9.81 / 8.0:
            mass = float(np.sum(dg * left[:, :3]) / np.sum(dg * dg))
            rows = np.concatenate([-_skew(x) for x in dg])  # first x g = -g x first
            first = np.linalg.lstsq(rows, left[:, 3:].ravel(), rcond=1e-6)[0]
            told = np.hstack([mass * g, np.cross(first, g)])
            bias = (w - told).mean(axis=0)
            left = w - told - bias
    spread = (float(np.sqrt(np.mean(left[:, :3] ** 2))), float(np.sqrt(np.mean(left[:, 3:] ** 2))))
    return Tare(bias[:3], bias[3:], mass, first, spread)


def _skew(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
