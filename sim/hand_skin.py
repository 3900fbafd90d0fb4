"""Exact contact of fingertips with ellipsoids and meshes.

FCL finds the contact of a sphere with an ellipsoid by iteration to 1e-6 m. A tip that slides with
1.5 N lies no deeper than that, so contacts come and go, and now and then a normal is off by 0.3 rad
and throws the tip off the surface for some milliseconds. A sphere on a box is exact: each tip
therefore meets, in place of an ellipsoid, a small plate of its own, that is laid before every step
on the ellipsoid's surface where the tip is nearest. So it does with a mesh, over whose edges it
rolls as a ball does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import dartpy as dart
import numpy as np
from numpy.typing import NDArray

from sim.hand_objects import CURVED, Piece, Thing
from sim.mesh import read
from sim.robot_world import isometry, transform

Array = NDArray[np.float64]
Nearest = Callable[[Array], tuple[Array, Array] | None]
"""From a point outside to the nearest of a surface and the normal there."""

PLATE = (0.016, 0.016, 0.006)
"""Of a plate, small enough to stay in what it covers [m]."""
WEIGHTLESS = 1e-6
"""Mass of a plate [kg]."""
TOLERANCE = 1e-13
"""Of the parameter of the nearest point, over the semi-axes' square [m^2]."""


class Skin:
    """Plates on the curved pieces of an object, one for each tip and piece.

    Args:
        thing: the object.
        scale: of its profile [1].
        skeleton: of it, whose body ``object_round`` has these pieces.
        tips: bodies of the fingertips.
        others: bodies that may meet the object but not the plates.
        collision_filter: of the world; what plates must not touch is told to it.
        friction: of the object's surface [1].
    """

    def __init__(
        self,
        thing: Thing,
        scale: float,
        skeleton: Any,
        tips: Sequence[Any],
        others: Iterable[Any],
        collision_filter: Any,
        friction: float,
    ) -> None:
        self._body = skeleton.getBodyNode("object")
        self._tips = list(tips)
        self._round = [(_nearest_on(p, scale), p.height) for p in thing.pieces if p.kind in CURVED]
        ellipsoids = skeleton.getBodyNode("object_round")
        bodies = [*self._tips, *others]
        self._plates: list[list[Any]] = []
        for i, tip in enumerate(self._tips):
            collision_filter.addBodyNodePairToBlackList(tip, ellipsoids)
            _, carrier = skeleton.createWeldJointAndBodyNodePair(self._body)
            carrier.setName(f"object_skin{i}")
            moment = WEIGHTLESS * 1e-4 * np.eye(3)
            carrier.setInertia(dart.dynamics.Inertia(WEIGHTLESS, np.zeros(3), moment))
            for body in bodies:
                if body is not tip:
                    collision_filter.addBodyNodePairToBlackList(body, carrier)
            self._plates.append([_plate(carrier, height, friction) for _, height in self._round])

    def fit(self) -> None:
        """Lay the plates where the tips are now."""
        R, p = transform(self._body)
        for tip, plates in zip(self._tips, self._plates, strict=True):
            x = R.T @ (np.asarray(tip.getWorldTransform().translation()).reshape(3) - p)
            for plate, (nearest_on, height) in zip(plates, self._round, strict=True):
                up = np.array([0.0, 0.0, height])
                found = nearest_on(x - up)
                if found is not None:
                    point, normal = found
                    middle = point - 0.5 * PLATE[2] * normal + up
                    plate.setRelativeTransform(isometry(_facing(normal), middle))


def _nearest_on(piece: Piece, scale: float) -> Nearest:
    if piece.kind == "mesh":
        return read(piece.file).scaled(scale).nearest
    semi = np.array([piece.size[0] * scale, piece.size[1] * scale, piece.size[2]]) / 2.0
    return partial(nearest, semi=semi)


def nearest(x: Array, semi: Array) -> tuple[Array, Array] | None:
    """The point of an ellipsoid nearest to one outside, and the normal out of it there.

    Newton on ``sum (a_i x_i / (a_i^2 + t))^2 = 1``; the sum is convex: t comes from below.

    Args:
        x: the point, in the ellipsoid's axes, shape (3,) [m].
        semi: its semi-axes, shape (3,) [m].

    Returns:
        Point (3,) [m] and unit normal (3,); None for a point that is not outside.
    """
    terms = [(a * a, a * a * v * v) for a, v in zip(semi.tolist(), x.tolist(), strict=True)]
    if sum(b / (a * a) for a, b in terms) <= 1.0:
        return None
    t = 0.0
    for _ in range(50):
        value = sum(b / (a + t) ** 2 for a, b in terms) - 1.0
        slope = -2.0 * sum(b / (a + t) ** 3 for a, b in terms)
        step = -value / slope
        t += step
        if step < TOLERANCE * terms[0][0]:
            break
    normal = x / (semi * semi + t)
    size = math.sqrt(float(normal @ normal))
    return semi * semi * x / (semi * semi + t), normal / size


def _plate(body: Any, height: float, friction: float) -> Any:
    node = body.createShapeNode(dart.dynamics.BoxShape(list(PLATE)))
    node.setRelativeTransform(isometry(np.eye(3), np.array([0.0, 0.0, height])))
    node.createCollisionAspect()
    node.createDynamicsAspect().setFrictionCoeff(friction)
    return node


def _facing(normal: Array) -> Array:
    """A rotation whose z is the normal, shape (3, 3)."""
    first = np.zeros(3)
    first[int(np.argmin(np.abs(normal)))] = 1.0
    first -= normal * (first @ normal)
    first /= math.sqrt(float(first @ first))
    return np.column_stack([first, np.cross(normal, first), normal])
