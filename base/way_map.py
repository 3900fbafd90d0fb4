"""The shortest free way over a square of floor around the platform."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from services.messages import Array

CELL = 0.05
"""[m]"""
_BLOCKED = 1e4  # cost of a metre where the platform does not fit: ways through it show by that


@dataclass(frozen=True)
class Way:
    """A way from the platform to the goal, or to the edge of the square towards it.

    Attributes:
        points: (n, 2) in O, first to last [m].
        clearance: (n,) from these points to the nearest obstacle [m].
        blocked: length of it where the platform does not fit [m].
        ends_blocked: it does not fit at the goal.
    """

    points: Array
    clearance: Array
    blocked: float
    ends_blocked: bool


class WayMap:
    """A grid that is laid anew around the platform for every search.

    A step costs its length, more where it is narrow, so that the way keeps to the middle of gaps
    and its distance from corners where that is cheap.

    Args:
        fits: clearance that the platform needs [m].
        comfort: clearance from which on more is not better [m].
        half: of the side of the square, in cells.
    """

    def __init__(self, fits: float, comfort: float, half: int = 64) -> None:
        self._fits, self._comfort = fits, comfort
        self._half, self._n = half, 2 * half + 1
        n = self._n
        index = np.arange(n * n).reshape(n, n)
        pairs = [
            (index[:, :-1], index[:, 1:], 1.0),
            (index[:-1], index[1:], 1.0),
            (index[:-1, :-1], index[1:, 1:], math.sqrt(2)),
            (index[:-1, 1:], index[1:, :-1], math.sqrt(2)),
        ]
        a = np.concatenate([p[0].ravel() for p in pairs])
        b = np.concatenate([p[1].ravel() for p in pairs])
        length = np.concatenate([np.full(p[0].size, p[2] * CELL) for p in pairs])
        rim = np.concatenate([index[0], index[-1], index[1:-1, 0], index[1:-1, -1]])
        # one node more: the goal, where it lies beyond the rim
        rows = np.concatenate([a, b, np.full(len(rim), n * n)])
        columns = np.concatenate([b, a, rim])
        order = np.lexsort((columns, rows))
        self._rows, self._columns = rows[order], columns[order]
        self._length = np.concatenate([length, length, np.zeros(len(rim))])[order]
        self._rim = self._rows == n * n
        starts = np.searchsorted(self._rows, np.arange(n * n + 2))
        self._graph = csr_matrix(
            (self._length.copy(), self._columns, starts), shape=(n * n + 1, n * n + 1)
        )
        offsets = (np.arange(n) - half) * CELL
        self._x, self._y = np.meshgrid(offsets, offsets, indexing="ij")

    def search(self, start: Array, goal: Array, standing: Array, passing: Array) -> Way:
        """The cheapest way.

        Args:
            start: (2,) in O [m].
            goal: (2,) in O [m].
            standing: (m, 2) points of obstacles in O.
            passing: (k, 2) where something will pass: as an obstacle, but not blocked for good.
        """
        n, half = self._n, self._half
        clearance = self._clearance(standing - start)
        cost = self._cost(clearance)
        if len(passing):
            cost = np.maximum(cost, np.minimum(self._cost(self._clearance(passing - start)), 30.0))
        flat = np.append(cost.ravel(), 0.0)
        graph = self._graph
        np.multiply(self._length, 0.5 * (flat[self._rows] + flat[self._columns]), out=graph.data)
        cell = np.rint((goal - start) / CELL)
        inside = bool(np.abs(cell).max() <= half)
        if inside:
            source = int((cell[0] + half) * n + cell[1] + half)
            graph.data[self._rim] = np.inf
        else:
            source = n * n
            rim = self._columns[self._rim]
            beyond = goal - start - np.column_stack([self._x.ravel()[rim], self._y.ravel()[rim]])
            graph.data[self._rim] = np.hypot(beyond[:, 0], beyond[:, 1]) + CELL * flat[rim]
        before = dijkstra(graph, indices=source, return_predecessors=True)[1]
        chain = [half * n + half]
        while before[chain[-1]] >= 0 and before[chain[-1]] != n * n:
            chain.append(int(before[chain[-1]]))
        cells = np.array(chain)
        points = np.column_stack([self._x.ravel()[cells], self._y.ravel()[cells]]) + start
        if inside:
            points[-1] = goal
        narrow = clearance.ravel()[cells]
        # where the platform stands it fits, whatever noise says
        inner = np.hypot(*(points - start).T) > 4 * CELL
        tight = (narrow < self._fits) & inner
        return Way(points, narrow, CELL * np.count_nonzero(tight), inside and bool(tight[-1]))

    def _cost(self, clearance: Array) -> Array:
        """Of a metre."""
        lack = np.clip((self._comfort - clearance) / (self._comfort - self._fits), 0.0, 1.0)
        return np.where(clearance < self._fits, _BLOCKED, 1.0 + 2.0 * lack * lack)

    def _clearance(self, points: Array) -> Array:
        """(n, n) from the middle of each cell to the nearest of points around the start [m]."""
        n, half = self._n, self._half
        cells = np.rint(points / CELL).astype(int) + half
        inside = ((cells >= 0) & (cells < n)).all(axis=1)
        cells, points = cells[inside], points[inside]
        if not len(points):
            return np.full((n, n), 1e3)
        free = np.ones((n, n), dtype=bool)
        free[cells[:, 0], cells[:, 1]] = False
        x, y = np.zeros((n, n)), np.zeros((n, n))
        x[cells[:, 0], cells[:, 1]], y[cells[:, 0], cells[:, 1]] = points[:, 0], points[:, 1]
        i, j = distance_transform_edt(free, return_distances=False, return_indices=True)
        return np.hypot(x[i, j] - self._x, y[i, j] - self._y)
