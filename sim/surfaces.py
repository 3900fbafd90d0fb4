"""Objects as signed surfaces: how far a point is from them, and where it would touch. No DART.

For contacts that float: a point, or the centre of a spherical tip, is brought back to the surface
(or to the tip's radius from it) after every step, and feels the normal there. All objects stand
along z with their middle at the origin. Normals point out of the object.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Surface(Protocol):
    """What an object is to a finger."""

    @property
    def half(self) -> Array:
        """Half of the extent along x, y, z, (3,) [m]."""

    def sense(self, p: Array) -> tuple[Array, Array]:
        """Signed distance (k,) [m], and its gradient, the unit normal (k, 3), at points (k, 3)."""


@dataclass(frozen=True)
class Box:
    """A box with the half extents ``size`` [m]."""

    size: tuple[float, float, float]

    @property
    def half(self) -> Array:
        """See ``Surface``."""
        return np.array(self.size)

    def sense(self, p: Array) -> tuple[Array, Array]:
        """See ``Surface``."""
        return _corner(p, np.abs(p) - self.half, np.sign(p)[:, :, None] * np.eye(3))


@dataclass(frozen=True)
class Cylinder:
    """A cylinder with flat ends: radius and half height [m]."""

    radius: float
    height: float

    @property
    def half(self) -> Array:
        """See ``Surface``."""
        return np.array([self.radius, self.radius, self.height])

    def sense(self, p: Array) -> tuple[Array, Array]:
        """See ``Surface``."""
        around = np.hypot(p[:, 0], p[:, 1])
        over = np.stack([around - self.radius, np.abs(p[:, 2]) - self.height], axis=1)
        out = np.zeros((len(p), 2, 3))
        out[:, 0, :2] = p[:, :2] / np.maximum(around, 1e-12)[:, None]
        out[:, 1, 2] = np.sign(p[:, 2])
        return _corner(p, over, out)


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid with the semi-axes ``axes`` [m]."""

    axes: tuple[float, float, float]

    @property
    def half(self) -> Array:
        """See ``Surface``."""
        return np.array(self.axes)

    def sense(self, p: Array) -> tuple[Array, Array]:
        """See ``Surface``; the nearest point q solves p - q = t n(q), one equation in t."""
        a2 = self.half**2
        # sum (a p / (t + a^2))^2 is convex and falls in t from its last pole on: Newton that starts
        # left of where it is 1, as where one term alone is 1, never passes that
        t = np.max(np.abs(p) * self.half - a2, axis=1)
        t = np.maximum(t, -a2.min() + 1e-12)
        for _ in range(60):
            u = (p * self.half) / (t[:, None] + a2)
            value = np.sum(u * u, axis=1) - 1.0
            slope = -2.0 * np.sum(u * u / (t[:, None] + a2), axis=1)
            move = value / np.minimum(slope, -1e-12)
            t = t - move
            if np.max(np.abs(move)) < 1e-15:
                break
        q = p * a2 / (t[:, None] + a2)
        n = _unit(q / a2)
        return np.sum((p - q) * n, axis=1), n


@dataclass(frozen=True)
class Bottle:
    """An upright bottle: a superellipse all the way up, flat ends, narrower towards the neck.

    |x / a|^e + |y / b|^e = scale(z)^e; the scale is 1 up to ``shoulder``, then falls smoothly to
    ``neck`` at the top. The distance is of first order: exact on the surface, and within 1 mm at
    12 mm from it.

    Attributes:
        width, depth: a, b [m].
        height: half of the height [m].
        exponent: e; 2 is an ellipse, more is nearer a box.
        shoulder: z from where on it narrows [m].
        neck: scale at the top.
    """

    width: float
    depth: float
    height: float
    exponent: float = 2.5
    shoulder: float = 0.05
    neck: float = 0.5

    @property
    def half(self) -> Array:
        """See ``Surface``."""
        return np.array([self.width, self.depth, self.height])

    def sense(self, p: Array) -> tuple[Array, Array]:
        """See ``Surface``."""
        e = self.exponent
        x, y = np.abs(p[:, 0]) / self.width, np.abs(p[:, 1]) / self.depth
        size = np.maximum((x**e + y**e) ** (1.0 / e), 1e-9)
        up = np.clip((p[:, 2] - self.shoulder) / (self.height - self.shoulder), 0.0, 1.0)
        drop = 1.0 - self.neck
        scale = 1.0 - drop * up * up * (3.0 - 2.0 * up)
        taper = drop * 6.0 * up * (1.0 - up) / (self.height - self.shoulder)
        side = np.stack(
            [
                np.sign(p[:, 0]) * (x / size) ** (e - 1.0) / self.width,
                np.sign(p[:, 1]) * (y / size) ** (e - 1.0) / self.depth,
                taper,
            ],
            axis=1,
        )
        steep = np.maximum(np.linalg.norm(side, axis=1), 1e-12)
        over = np.stack([(size - scale) / steep, np.abs(p[:, 2]) - self.height], axis=1)
        out = np.zeros((len(p), 2, 3))
        out[:, 0] = side / steep[:, None]
        out[:, 1, 2] = np.sign(p[:, 2])
        return _corner(p, over, out)


OBJECTS: dict[str, Surface] = {
    "cylinder": Cylinder(0.05, 0.10),
    "box": Box((0.035, 0.05, 0.10)),
    "ellipsoid": Ellipsoid((0.03, 0.05, 0.10)),
    "squirt": Bottle(0.03, 0.045, 0.10, 2.5, 0.02, 0.45),
    "detergent": Bottle(0.035, 0.06, 0.13, 3.5, 0.05, 0.4),
}
"""Towel roll 10 x 20 cm and others of like size; the papers give no size of their bottles."""


def touch(surface: Surface, p: Array, tip: float = 0.0) -> tuple[Array, Array, Array]:
    """Bring tips back onto a surface.

    Args:
        surface: what they touch.
        p: centres of the tips, (k, 3) [m].
        tip: their radius; 0 for points [m].

    Returns:
        Centres at the tip's radius from the surface, points of contact, unit normals *into* the
        object, (k, 3) each.
    """
    distance, n = surface.sense(p)
    q = p
    for _ in range(8):
        q = q - distance[:, None] * n
        distance, again = surface.sense(q)
        if np.max(np.abs(distance)) < 1e-10:
            break
        n = again
    # on an edge the normal is where the tip came from, not either face's
    gap = p - q
    far = np.linalg.norm(gap, axis=1)
    outside = (far > 1e-9) & (np.sum(gap * n, axis=1) > 0.0)
    n = np.where(outside[:, None], gap / np.maximum(far, 1e-12)[:, None], n)
    return q + tip * n, q, -n


def scatter(surface: Surface, k: int, rng: np.random.Generator) -> Array:
    """Points spread evenly over the area of a surface, (k, 3) [m]."""
    shell = 0.002
    found: list[Array] = []
    while len(found) < k:
        p = rng.uniform(-1.0, 1.0, (64, 3)) * (surface.half + shell)
        near = np.abs(surface.sense(p)[0]) < shell
        found += list(touch(surface, p[near])[1]) if near.any() else []
    return np.array(found[:k])


def outwards(surface: Surface, k: int, rng: np.random.Generator) -> Array:
    """Points where rays from the middle in even directions leave a surface, (k, 3) [m]."""
    ray = _unit(rng.normal(size=(k, 3)))
    low, high = np.zeros((k, 1)), np.full((k, 1), 2.0 * float(np.linalg.norm(surface.half)))
    for _ in range(50):
        middle = (low + high) / 2.0
        inside = (surface.sense(ray * middle)[0] < 0.0)[:, None]
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return ray * low


def _corner(p: Array, over: Array, out: Array) -> tuple[Array, Array]:
    """Distance to where several sides meet: their excess (k, s), their normals (k, s, 3)."""
    beyond = np.maximum(over, 0.0)
    far = np.linalg.norm(beyond, axis=1)
    nearest = np.argmax(over, axis=1)
    inside = far == 0.0
    pick = np.where(inside[:, None], np.eye(over.shape[1])[nearest], beyond)
    distance = np.where(inside, over.max(axis=1), far)
    return distance, _unit(np.einsum("ks,ksj->kj", pick, out))


def _unit(v: Array) -> Array:
    unit: Array = v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-300)
    return unit
