"""Objects to be grasped by a hand: convex pieces on an upright axis, sizes stated here.

| name | pieces | profile [m] | height [m] | mass [kg] |
|---|---|---|---|---|
| roll | cylinder | diameter 0.10 | 0.20 | 0.5 |
| bottle | round body, shoulder, neck with cap | diameter 0.09 | 0.20 | 0.5 |
| squirt | ellipsoid body, neck, nozzle head | 0.060 x 0.085 | 0.20 | 0.5 |
| detergent | wide ellipsoid, slimmer one above (a taper), cap | 0.065 x 0.095 | 0.21 | 0.5 |

Or any closed mesh in a file (``sim.mesh``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import dartpy as dart
import numpy as np

from sim import mesh


@dataclass(frozen=True)
class Piece:
    """A convex piece of an object, its middle on the object's axis.

    Attributes:
        kind: ``cylinder`` (diameter, diameter, height), ``ellipsoid`` (diameters), ``box``, or
            ``mesh``, which needs not be convex.
        size: [m].
        height: of its middle above the object's foot [m]; of a mesh, of its foot.
        file: of a mesh.
    """

    kind: str
    size: tuple[float, float, float]
    height: float
    file: str = ""


@dataclass(frozen=True)
class Thing:
    """An object standing on its foot, its axis along z.

    Attributes:
        pieces: of its body.
        height: of the whole [m].
        mass: [kg].
        grasp: stretch of the axis that a reach aims at, above the foot [m].
        radius: characteristic one, that weighs moments against forces [m].
    """

    pieces: tuple[Piece, ...]
    height: float
    mass: float
    grasp: tuple[float, float]
    radius: float = 0.05


THINGS = {
    "roll": Thing(
        (Piece("cylinder", (0.10, 0.10, 0.20), 0.10),), height=0.20, mass=0.5, grasp=(0.12, 0.15)
    ),
    "bottle": Thing(
        (
            Piece("cylinder", (0.09, 0.09, 0.15), 0.075),
            Piece("ellipsoid", (0.09, 0.09, 0.05), 0.15),
            Piece("cylinder", (0.03, 0.03, 0.04), 0.18),
        ),
        height=0.20,
        mass=0.5,
        grasp=(0.12, 0.14),
    ),
    "squirt": Thing(
        (
            Piece("ellipsoid", (0.060, 0.085, 0.17), 0.085),
            Piece("cylinder", (0.024, 0.024, 0.04), 0.165),
            Piece("box", (0.024, 0.05, 0.02), 0.19),
            Piece("cylinder", (0.06, 0.06, 0.01), 0.005),
        ),
        height=0.20,
        mass=0.5,
        grasp=(0.085, 0.115),
    ),
    "detergent": Thing(
        (
            Piece("ellipsoid", (0.065, 0.095, 0.17), 0.085),
            Piece("ellipsoid", (0.050, 0.070, 0.16), 0.11),
            Piece("cylinder", (0.036, 0.036, 0.03), 0.195),
            Piece("cylinder", (0.06, 0.06, 0.01), 0.005),
        ),
        height=0.21,
        mass=0.5,
        grasp=(0.085, 0.115),
    ),
}
"""Objects by name."""
CURVED = ("ellipsoid", "mesh")
"""Kinds that tips meet by the plates of ``sim.hand_skin``."""
MASS, REACHED = 0.5, (0.60, 0.75)
"""Of a mesh [kg]; the stretch a reach aims at, as shares of its height."""


def find(name: str) -> Thing:
    """An object by its name, or from a mesh file by its path; ValueError if there is neither."""
    if name in THINGS:
        return THINGS[name]
    if not name.lower().endswith(mesh.SUFFIXES):
        raise ValueError(f"unknown object {name!r}; known: {', '.join(THINGS)}, or a mesh file")
    size = mesh.read(name).size
    x, y, z = size.tolist()
    low, high = (share * z for share in REACHED)
    radius = 0.25 * (x + y)
    return Thing((Piece("mesh", (x, y, z), 0.0, name),), z, MASS, (low, high), radius)


def build(thing: Thing, friction: float, fixed: bool, mass: float, scale: float = 1.0) -> Any:
    """A DART skeleton of an object: body ``object``, its origin at the foot, has all of the mass.

    Its ellipsoids and meshes are on a body welded to it, ``object_round`` (see ``sim.hand_skin``).

    Args:
        thing: what to build.
        friction: of its surface [1].
        fixed: bolted to where it stands.
        mass: [kg].
        scale: of its profile, not of its height [1].
    """
    skeleton = dart.dynamics.Skeleton("object")
    if fixed:
        _, body = skeleton.createWeldJointAndBodyNodePair()
    else:
        _, body = skeleton.createFreeJointAndBodyNodePair()
    body.setName("object")
    _, curved = skeleton.createWeldJointAndBodyNodePair(body)
    curved.setName("object_round")
    curved.setInertia(dart.dynamics.Inertia(1e-6, np.zeros(3), 1e-10 * np.eye(3)))
    for piece in thing.pieces:
        owner = curved if piece.kind in CURVED else body
        node = owner.createShapeNode(_shape(piece, scale))
        X = dart.math.Isometry3()
        X.set_translation(_place(piece, scale))
        node.setRelativeTransform(X)
        node.createVisualAspect()
        node.createCollisionAspect()
        node.createDynamicsAspect().setFrictionCoeff(friction)
    x, y = (scale * v for v in thing.pieces[0].size[:2])
    h = thing.height
    # of a solid elliptic cylinder: what is inside a bottle does not matter here
    moment = np.diag([y * y / 16 + h * h / 12, x * x / 16 + h * h / 12, (x * x + y * y) / 16])
    body.setInertia(dart.dynamics.Inertia(mass, np.array([0.0, 0.0, 0.45 * h]), mass * moment))
    return skeleton


def _place(piece: Piece, scale: float) -> Any:
    if piece.kind == "mesh":
        return mesh.read(piece.file).offset * [scale, scale, 1.0]
    return np.array([0.0, 0.0, piece.height])


def _shape(piece: Piece, scale: float) -> Any:
    if piece.kind == "mesh":
        return mesh.shape(piece.file, scale)
    x, y, z = piece.size[0] * scale, piece.size[1] * scale, piece.size[2]
    if piece.kind == "cylinder":
        return dart.dynamics.CylinderShape(x / 2, z)
    if piece.kind == "ellipsoid":
        return dart.dynamics.EllipsoidShape([x, y, z])
    return dart.dynamics.BoxShape([x, y, z])
