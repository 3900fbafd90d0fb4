"""Paths of a circle among shapes on a grid: what a bench knows of a world, and no robot does."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from sim.shapes import Shapes

Array = NDArray[np.float64]

CELL = 0.05
"""Of the grid [m]."""
STEPS = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))
"""From a cell to its neighbours, half of them: with the knight's moves a way is 3 % too long."""


class Grid:
    """The distance to shapes on a grid, to which more shapes may be added.

    Args:
        low: corner of the area with the smallest x, y [m].
        high: the opposite corner [m].
    """

    def __init__(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        self._low = np.array(low)
        self._shape = tuple(int(n) for n in np.ceil((np.array(high) - low) / CELL) + 1)
        i, j = np.indices(self._shape)
        self._points = self._low + CELL * np.stack([i.ravel(), j.ravel()], axis=1)
        self._shapes: list[Shapes] = []
        self._distance = np.full(len(self._points), np.inf)

    def add(self, shapes: Shapes) -> None:
        """Put shapes into the area."""
        self._shapes.append(shapes)
        self._distance = np.minimum(self._distance, shapes.distance(self._points))

    def passable(self, shapes: Shapes, a: Array, b: Array, radius: float) -> bool:
        """Whether a circle surely gets from ``a`` to ``b`` with ``shapes`` added as well.

        Args:
            shapes: not yet added.
            a: (2,) [m].
            b: (2,) [m].
            radius: of the circle [m].
        """
        distance = np.minimum(self._distance, shapes.distance(self._points))
        # between the cells it may be this much nearer than at their middles
        free = (distance >= radius + CELL / math.sqrt(2.0)).reshape(self._shape)
        regions, _ = label(free, structure=np.ones((3, 3)))
        first, last = regions[self._cell(a)], regions[self._cell(b)]
        return bool(first and first == last)

    def shortest(self, a: Array, b: Array, radius: float) -> float:
        """Length of the shortest way of a circle from ``a`` to ``b`` [m], infinite if none is.

        Args:
            a: (2,) [m].
            b: (2,) [m].
            radius: of the circle [m]; it may touch.
        """
        free = (self._distance >= radius).reshape(self._shape)
        number = np.arange(free.size).reshape(self._shape)
        rows, columns, lengths = [], [], []
        for di, dj in STEPS:
            near, far = _shifted(number, di, dj)
            ok = free.ravel()[near] & free.ravel()[far]
            if abs(di) + abs(dj) == 3:  # what lies between must be free as well
                half = (np.sign(di), np.sign(dj)) if di * dj else (di, dj)
                between = near + half[0] * self._shape[1] + half[1]
                ok &= free.ravel()[between]
            rows.append(near[ok])
            columns.append(far[ok])
            lengths.append(np.full(int(ok.sum()), CELL * math.hypot(di, dj)))
        edges = (np.concatenate(rows), np.concatenate(columns))
        graph = coo_array((np.concatenate(lengths), edges), shape=(free.size, free.size)).tocsr()
        first, last = number[self._cell(a)], number[self._cell(b)]
        length, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
        if not np.isfinite(length[last]):
            return math.inf
        cells = [int(last)]
        while cells[-1] != first:
            cells.append(int(before[cells[-1]]))
        way = [a, *self._points[cells[-2:0:-1]], b]
        return self._pulled(way, radius)

    def _pulled(self, way: list[Array], radius: float) -> float:
        """Length of a way after every detour that a straight line avoids is taken out [m]."""
        length, at = 0.0, 0
        while at < len(way) - 1:
            to = len(way) - 1
            while to > at + 1 and not self._straight(way[at], way[to], radius):
                to -= 1
            length += float(np.linalg.norm(way[to] - way[at]))
            at = to
        return length

    def _straight(self, a: Array, b: Array, radius: float) -> bool:
        count = max(2, math.ceil(float(np.linalg.norm(b - a)) / 0.02))
        points = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
        return all((shapes.distance(points) >= radius - 1e-3).all() for shapes in self._shapes)

    def _cell(self, point: Array) -> tuple[int, int]:
        i, j = np.rint((point - self._low) / CELL).astype(int)
        return int(i), int(j)


def _shifted(
    number: NDArray[np.int_], di: int, dj: int
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Numbers of all cells with a neighbour (di, dj) away, and of these neighbours."""
    width = number.shape[1]
    columns = slice(max(0, -dj), width - max(0, dj))
    other = slice(max(0, dj), width - max(0, -dj))
    return number[: number.shape[0] - di, columns].ravel(), number[di:, other].ravel()
