"""Objects whose shape is read from a mesh file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import dartpy as dart
import numpy as np
import trimesh
from numpy.typing import NDArray

Array = NDArray[np.float64]

SUFFIXES = (".stl", ".obj", ".ply", ".off")
HEIGHT = (0.05, 0.50)
"""Of what a hand of this size can be tried on [m]."""
MOST = 50_000
"""Triangles; the nearest one to each fingertip is looked for in every step of the physics."""
_URDF = """<robot name="object"><link name="object"><collision><geometry>
<mesh filename={}/></geometry></collision></link></robot>"""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed surface that stands on its foot.

    Attributes:
        triangles: corners with the middle of the bounds in x and y, and their bottom, at 0,
            shape (n, 3, 3) [m].
        offset: what was added to the file's coordinates, shape (3,) [m].
        size: of its bounds, shape (3,) [m].
    """

    triangles: Array
    offset: Array
    size: Array

    def scaled(self, scale: float) -> Surface:
        """Of a profile so many times as wide, and of the same height."""
        return Surface(self.triangles * [scale, scale, 1.0])


class Surface:
    """Finds the nearest point of a surface.

    Args:
        triangles: corners, shape (n, 3, 3) [m].
    """

    def __init__(self, triangles: Array) -> None:
        self._triangles = triangles
        self._middles = triangles.mean(axis=1)
        self._radii = np.linalg.norm(triangles - self._middles[:, None], axis=2).max(axis=1)

    def nearest(self, x: Array) -> tuple[Array, Array] | None:
        """The nearest point, shape (3,) [m], and the unit direction from it to ``x``, (3,) [m].

        None for a point of the surface itself. Where a corner or an edge is nearest the direction
        turns around it, as the contact of a ball does.
        """
        away = np.linalg.norm(self._middles - x, axis=1)
        near = away - self._radii <= float((away + self._radii).min())
        triangles = self._triangles[near]
        points = trimesh.triangles.closest_point(triangles, np.tile(x, (len(triangles), 1)))
        ways = x - points
        distance = np.linalg.norm(ways, axis=1)
        best = int(distance.argmin())
        if distance[best] < 1e-9:
            return None
        return points[best], ways[best] / distance[best]


@cache
def read(file: str) -> Mesh:
    """A mesh file: metres, z upwards.

    Raises:
        ValueError: there is no such file, it cannot be read, is not closed, or has not the size of
            something for a hand; with the file, and what would help.
    """
    path = Path(file)
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"{file}: not a mesh file; known are {', '.join(SUFFIXES)}")
    if not path.is_file():
        raise ValueError(f"{file}: there is no such file")
    try:
        mesh = trimesh.load_mesh(path)
    except Exception as error:  # of many kinds, by format
        raise ValueError(f"{file}: cannot be read as a mesh: {error}") from error
    if not len(mesh.faces):
        raise ValueError(f"{file}: has no triangles")
    if len(mesh.faces) > MOST:
        raise ValueError(f"{file}: {len(mesh.faces)} triangles of at most {MOST}; simplify it")
    if not mesh.is_watertight:
        raise ValueError(f"{file}: the surface is not closed; fill its holes")
    low, high = mesh.bounds
    if not HEIGHT[0] <= high[2] - low[2] <= HEIGHT[1]:
        raise ValueError(
            f"{file}: {high[2] - low[2]:g} m high, of {HEIGHT[0]:g} to {HEIGHT[1]:g} m; a mesh is "
            "in metres, z upwards: scale it by 0.001 if it is in millimetres"
        )
    offset = -np.array([*(0.5 * (low + high))[:2], low[2]])
    return Mesh(np.asarray(mesh.triangles) + offset, offset, np.asarray(high - low))


def shape(file: str, scale: float) -> Any:
    """The DART shape of a file that was ``read``, in the file's own coordinates.

    Only DART's reader of URDF makes one from a file.

    Args:
        file: of the mesh.
        scale: of its profile, not of its height [1].
    """
    text = _URDF.format(quoteattr(str(Path(file).resolve())))
    skeleton = dart.utils.DartLoader().parseSkeletonString(text, dart.common.Uri(""))
    found = skeleton.getBodyNode(0).getShapeNodes()[0].getShape()
    found.setScale([scale, scale, 1.0])
    return found
