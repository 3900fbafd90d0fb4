"""The shortest free way over a square of floor around the platform."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from base.polyline import CELL, clear, line, rest
from base.seen import Seen
from services.messages import Array

_BLOCKED = 1e4  # cost of a metre where the platform does not fit: ways through it show by that
_SOON = 30.0  # cost of a metre where something will pass, and around the platform at most
_DOUBT = 0.015  # more clearance than it needs, that a way not taken yet must have [m]
_DOUBTED = 100.0  # cost of a metre of it
_UNSEEN = 1.5  # factor on the cost of floor that no beam went over: it may be blocked
_HERE = 4  # cells around the platform: where it stands it fits, whatever noise says
_AROUND = 1.5  # factor on the length of what lies beyond, for a way round the square
_EXTRA = (0.3, 1.2)  # over the straight line's, of ways looked for first, for speed [m]
_OPEN = 1e3  # clearance where nothing is near [m]
_STEPS = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))


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

    The way before is kept as long as it fits and no other is cheaper by ``worth``, so that two
    that are as good do not take turns. That also bounds the search (A*: straight ahead costs at
    least its length), which makes it quick. The cells stay where they are in O, so that a gap is
    not wide at one time and narrow at another.

    Args:
        fits: clearance that the platform needs [m].
        comfort: clearance from which on more is not better [m].
        half: of the side of the square, in cells.
        worth: what another way must save [m].
    """

    def __init__(self, fits: float, comfort: float, half: int = 64, worth: float = 0.15) -> None:
        self._fits, self._comfort, self._worth = fits, comfort, worth
        self._half, self._wide = half, 2 * half + 3  # with a border that is never entered
        wide = self._wide
        index = np.arange(wide * wide).reshape(wide, wide)
        inner = index[1:-1, 1:-1]
        entered = inner.ravel()
        self._rim = np.unique(np.concatenate([inner[0], inner[-1], inner[:, 0], inner[:, -1]]))
        self._centre = int(inner[half, half])
        nodes = wide * wide  # and one more: the goal, where it lies beyond the rim
        columns = np.tile(np.arange(nodes)[:, None], (1, 8))  # of the border, to itself
        for k, (di, dj) in enumerate(_STEPS):
            columns[entered, k] = entered + di * wide + dj
        offsets = (np.arange(wide) - half - 1) * CELL
        self._x, self._y = (a.ravel() for a in np.meshgrid(offsets, offsets, indexing="ij"))
        # nothing costs less than its length, and the way ends at the centre
        least = np.hypot(self._x, self._y)
        self._least = least
        gain = least[columns] - least[:, None] + 1e-9  # never negative by rounding
        self._gain = gain.reshape(wide, wide, 8)
        self._half_length = np.array([0.5 * CELL * math.hypot(*s) for s in _STEPS])
        self._graph = csr_matrix(
            (
                np.full(8 * nodes + len(self._rim), 1e9),
                np.concatenate([columns.ravel(), self._rim]).astype(np.int32),
                np.append(np.arange(nodes + 1) * 8, 8 * nodes + len(self._rim)).astype(np.int32),
            ),
            shape=(nodes + 1, nodes + 1),
        )

    def search(
        self,
        start: Array,
        goal: Array,
        standing: Array,
        passing: Array,
        before: Way | None = None,
        seen: Seen | None = None,
    ) -> Way:
        """The cheapest way, or the one before where that is as good.

        Args:
            start: (2,) in O [m].
            goal: (2,) in O [m].
            standing: (m, 2) points of obstacles in O.
            passing: (k, 2) where something will pass: as an obstacle, but not blocked for good.
            before: the newest way to this goal, if there was one.
            seen: floor that is known to be free; where it is not known a way costs more.
        """
        points = np.vstack([standing, passing])
        room = clear(start, goal, points)
        if room >= self._comfort:  # nothing is shorter, and nothing near it
            way = line(start, goal)
            return Way(way, np.full(len(way), room), 0.0, False)
        middle = np.rint(start / CELL) * CELL
        clearance = self._clearance(standing - middle)
        cost = self._cost(clearance)
        if len(passing):
            soon = self._cost(self._clearance(passing - middle))
            cost = np.maximum(cost, np.minimum(soon, _SOON))
        if seen is not None:
            side = self._x[:: self._wide]
            cost = np.where(seen.at(side + middle[0], side + middle[1]), cost, _UNSEEN * cost)
        here = slice(self._half + 1 - _HERE, self._half + 2 + _HERE)
        cost[here, here] = np.minimum(cost[here, here], _SOON)
        limit, kept = math.inf, None
        if before is not None:
            kept = self._judged(rest(before.points, start), middle, clearance)
            if kept.blocked == 0:
                step = np.diff(kept.points, axis=0)
                spent = self._at(cost, kept.points[1:] - middle, 1.0)
                limit = float(spent @ np.hypot(step[:, 0], step[:, 1])) - self._worth
        # a gap that was found too narrow once is not tried again for a millimetre
        doubtful = clearance < self._fits + _DOUBT
        doubtful[here, here] = False
        cost = np.where(doubtful, np.maximum(cost, _DOUBTED), cost)
        found = self._cheapest(goal - middle, cost, limit)
        if found is not None:
            found = middle + found
            way = np.vstack([start, found[1:], line(found[-1], goal)[1:]])
            inside = bool(np.abs(np.rint((goal - middle) / CELL)).max() <= self._half)
            return self._judged(way, middle, clearance, len(way) if inside else len(found))
        assert kept is not None
        return kept

    def _judged(
        self, points: Array, middle: Array, clearance: Array, count: int | None = None
    ) -> Way:
        """The way along points; ``count`` of them are a way, the others only show where to."""
        narrow = self._at(clearance, points - middle, _OPEN)
        away = np.abs(points - middle).max(axis=1)
        tight = (narrow < self._fits) & (away > (_HERE + 0.5) * CELL)
        if count is not None:
            tight[count:] = False
        blocked = CELL * float(np.count_nonzero(tight))
        return Way(points, narrow, blocked, bool(tight[-1]))

    def _cheapest(self, goal: Array, cost: Array, limit: float) -> Array | None:
        """(n, 2) from the centre to the goal, or the rim towards it; None if above the limit."""
        graph, nodes = self._graph, self._wide**2
        data = graph.data[: 8 * nodes].reshape(self._wide, self._wide, 8)
        middle = slice(1, -1)
        for k, (di, dj) in enumerate(_STEPS):
            there = cost[1 + di : self._wide - 1 + di, 1 + dj : self._wide - 1 + dj]
            out = self._half_length[k] * (cost[middle, middle] + there)
            data[middle, middle, k] = out + self._gain[middle, middle, k]
        cell = np.rint(goal / CELL).astype(int)
        if np.abs(cell).max() <= self._half:
            source = int((cell[0] + self._half + 1) * self._wide + cell[1] + self._half + 1)
            far = float(self._least[source])
        else:
            source, far = nodes, math.hypot(goal[0], goal[1])
            rim = self._rim
            beyond = np.hypot(goal[0] - self._x[rim], goal[1] - self._y[rim])
            # from a side that does not face the goal, straight on would lead back into the square
            x, y = self._x[rim], self._y[rim]
            edge = self._half * CELL - 1e-6
            faces = ((np.abs(x) > edge) & (x * (goal[0] - x) > 0)) | (
                (np.abs(y) > edge) & (y * (goal[1] - y) > 0)
            )
            beyond = np.where(faces, beyond, _AROUND * beyond)
            entry = CELL * cost.ravel()[rim] + self._least[rim] - far + 1e-9
            graph.data[8 * nodes :] = beyond + entry
        most = max(limit - far, 0.0)
        for extra in (*(e for e in _EXTRA if e < most), most):
            distance, before = dijkstra(
                graph, indices=source, return_predecessors=True, limit=extra
            )
            if math.isfinite(distance[self._centre]):
                break
        else:
            return None
        chain = [self._centre]
        while before[chain[-1]] >= 0 and before[chain[-1]] != nodes:
            chain.append(int(before[chain[-1]]))
        return np.column_stack([self._x[chain], self._y[chain]])

    def _at(self, field: Array, places: Array, beyond: float) -> Array:
        """(n,) values of a field at places (n, 2) around the start; ``beyond`` off the square."""
        cells = np.rint(places / CELL).astype(int)
        inside = (np.abs(cells) <= self._half).all(axis=1)
        out = np.full(len(places), beyond)
        i, j = cells[inside].T + self._half + 1
        out[inside] = field[i, j]
        return out

    def _cost(self, clearance: Array) -> Array:
        """Of a metre."""
        lack = np.clip((self._comfort - clearance) / (self._comfort - self._fits), 0.0, 1.0)
        return np.where(clearance < self._fits, _BLOCKED, 1.0 + 1.5 * lack * lack)

    def _clearance(self, points: Array) -> Array:
        """From the middle of each cell to the nearest of points around the start [m]."""
        cells = np.rint(points / CELL).astype(int) + self._half + 1
        inside = ((cells >= 0) & (cells < self._wide)).all(axis=1)
        cells, points = cells[inside], points[inside]
        shape = (self._wide, self._wide)
        if not len(points):
            return np.full(shape, _OPEN)
        free = np.ones(shape, dtype=bool)
        free[cells[:, 0], cells[:, 1]] = False
        x, y = np.zeros(shape), np.zeros(shape)
        x[cells[:, 0], cells[:, 1]], y[cells[:, 0], cells[:, 1]] = points[:, 0], points[:, 1]
        i, j = distance_transform_edt(free, return_distances=False, return_indices=True)
        out = np.hypot(x[i, j] - self._x.reshape(shape), y[i, j] - self._y.reshape(shape))
        out[0], out[-1], out[:, 0], out[:, -1] = 0.0, 0.0, 0.0, 0.0  # the border is never entered
        return out
