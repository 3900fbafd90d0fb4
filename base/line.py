"""A straight surface among the points of a scan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from base.planar import wrap
from services.messages import Array

_TRIMS = 4  # rounds in which what lies off the line is left out
_BAND = 0.04  # from the line, that always belongs to it [m]


@dataclass(frozen=True, slots=True)
class Line:
    """A line in the plane, with a front.

    Attributes:
        x: of a point on it [m].
        y: of that point [m].
        direction: of its normal, which points out of the front [rad].
    """

    x: float
    y: float
    direction: float

    def height(self, point: Array) -> float:
        """Distance of a point (2,) in front of the line [m]; negative behind it."""
        c, s = math.cos(self.direction), math.sin(self.direction)
        return float(c * (point[0] - self.x) + s * (point[1] - self.y))

    def blend(self, other: Line, share: float, at: Array) -> Line:
        """Between this line and a ``share`` of the other, in direction and in height of ``at``."""
        height = (1 - share) * self.height(at) + share * other.height(at)
        direction = self.direction + share * wrap(other.direction - self.direction)
        x = float(at[0]) - height * math.cos(direction)
        y = float(at[1]) - height * math.sin(direction)
        return Line(x, y, direction)


def fit(points: Array, front: Array) -> tuple[Line | None, float, int]:
    """The line nearest to points (n, 2) by total least squares, leaving out what lies off it.

    Args:
        points: (n, 2) [m].
        front: (2,) a point in front of it.

    Returns:
        The line, None of fewer than 3 points; rms distance of the points used [m]; how many.
    """
    used = points
    line: Line | None = None
    rms = 0.0
    for _ in range(_TRIMS):
        if len(used) < 3:
            return None, 0.0, len(used)
        middle = used.mean(axis=0)
        off = used - middle
        xx, yy = float(off[:, 0] @ off[:, 0]), float(off[:, 1] @ off[:, 1])
        xy = float(off[:, 0] @ off[:, 1])
        normal = 0.5 * math.atan2(2 * xy, xx - yy) + math.pi / 2
        line = Line(float(middle[0]), float(middle[1]), normal)
        if line.height(front) < 0:
            line = Line(line.x, line.y, normal + math.pi)
        n = np.array([math.cos(normal), math.sin(normal)])
        rms = math.sqrt(float(np.mean((off @ n) ** 2)))
        distance = np.abs((points - middle) @ n)
        kept = points[distance < max(_BAND, 1.5 * rms)]
        if len(kept) == len(used):
            break
        used = kept
    return line, rms, len(used)
