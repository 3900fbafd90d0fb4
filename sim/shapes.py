"""Boxes and circles in the plane: where a ray ends, how far a point is away. No DART."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NOTHING = 1e3
"""Distance [m] where there is nothing."""


class Shapes:
    """Boxes and circles, all given in one frame.

    Args:
        boxes: middle x, y [m], yaw [rad], half length, half width [m] of each, shape (n, 5).
        circles: middle x, y, radius of each [m], shape (m, 3).
    """

    def __init__(self, boxes: Array, circles: Array) -> None:
        self._boxes = np.asarray(boxes, dtype=float).reshape(-1, 5)
        self.circles = np.asarray(circles, dtype=float).reshape(-1, 3)
        c, s = np.cos(self._boxes[:, 2]), np.sin(self._boxes[:, 2])
        # into each box's own frame, of which it is the part where |p| <= half
        self._turn = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], -2)
        self._middle = self._boxes[:, :2]
        self._half = self._boxes[:, 3:]

    def __len__(self) -> int:
        return len(self._boxes) + len(self.circles)

    def cast(self, origin: Array, bearings: Array, farthest: float = NOTHING) -> Array:
        """Where rays end.

        Args:
            origin: of all rays, (2,) [m].
            bearings: of each ray, counter-clockwise from x, (k,) [rad].
            farthest: range of a ray that meets nothing up to there [m].

        Returns:
            Distance to the first shape met, (k,) [m]; 0 for all if the origin is inside of one.
        """
        ranges = np.full(len(bearings), farthest)
        rays = np.stack([np.cos(bearings), np.sin(bearings)])
        if len(self._boxes):
            start = np.einsum("nij,nj->ni", self._turn, origin - self._middle)[:, :, None]
            along = self._turn @ rays
            along = np.where(np.abs(along) < 1e-12, 1e-12, along)
            half = self._half[:, :, None]
            first, second = (-half - start) / along, (half - start) / along
            enters = np.minimum(first, second).max(axis=1)
            leaves = np.maximum(first, second).min(axis=1)
            hit = (enters <= leaves) & (leaves >= 0.0)
            ranges = np.minimum(ranges, np.where(hit, enters, np.inf).min(axis=0))
        if len(self.circles):
            to = self.circles[:, :2] - origin
            along = to @ rays
            # of the chord: half its length squared; what is left to the middle is across the ray
            gap = np.sum(to * to, axis=1)[:, None] - along * along
            chord = self.circles[:, 2:] ** 2 - gap
            half = np.sqrt(np.maximum(chord, 0.0))
            hit = (chord >= 0.0) & (along + half >= 0.0)
            ranges = np.minimum(ranges, np.where(hit, along - half, np.inf).min(axis=0))
        return np.maximum(ranges, 0.0)

    def nearest(self, point: Array) -> tuple[Array, Array]:
        """The shapes as seen from a point.

        Args:
            point: (2,) [m].

        Returns:
            Distance to the edge of each, boxes first, (n + m,) [m], negative inside; and unit
            vectors towards the nearest point of each edge (away from it, if inside), (n + m, 2).
        """
        own = np.einsum("nij,nj->ni", self._turn, point - self._middle)
        over = np.abs(own) - self._half
        outside = np.maximum(over, 0.0)
        far = np.sqrt(np.sum(outside * outside, axis=1))
        inside = np.minimum(over.max(axis=1), 0.0) if len(own) else far
        sign = np.where(own >= 0.0, 1.0, -1.0)
        # from inside, straight out through the nearest side
        side = (over == over.max(axis=1, keepdims=True)) if len(own) else over
        toward = -sign * np.where((far > 0.0)[:, None], outside, side)
        toward = np.einsum("nji,nj->ni", self._turn, toward)
        to = self.circles[:, :2] - point
        vectors = np.concatenate([toward, to])
        length = np.sqrt(np.sum(vectors * vectors, axis=1))
        distance = np.concatenate([far + inside, length[len(own) :] - self.circles[:, 2]])
        return distance, vectors / np.maximum(length, 1e-12)[:, None]

    def distance(self, points: Array) -> Array:
        """Distance from points to the nearest shape.

        Args:
            points: (k, 2) [m].

        Returns:
            (k,) [m], negative inside a shape; ``NOTHING`` where there is none.
        """
        out = np.full(len(points), NOTHING)
        for turn, middle, half in zip(self._turn, self._middle, self._half, strict=True):
            over = np.abs((points - middle) @ turn.T) - half
            far = np.hypot(*np.maximum(over, 0.0).T) + np.minimum(over.max(axis=1), 0.0)
            out = np.minimum(out, far)
        for x, y, radius in self.circles:
            out = np.minimum(out, np.hypot(points[:, 0] - x, points[:, 1] - y) - radius)
        return out
