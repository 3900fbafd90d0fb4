"""Which floor the laser has ever seen to be free."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from base.view import View
from services.messages import Array

_CELL = 0.1  # [m]
_CELLS = 256  # kept each way; what is further apart takes each other's place
_REACH = 32  # cells around the laser that a scan is worked into
_WAITING = 100  # newest scans that wait to be worked in until somebody asks


class Seen:
    """A grid in O that goes with the platform: a cell holds the number of the place it stands for.

    So nothing has to be cleared where the platform comes to new floor.
    """

    def __init__(self) -> None:
        self._place = np.full((_CELLS, _CELLS), -1, dtype=np.int64)
        self._new: deque[tuple[View, Array]] = deque(maxlen=_WAITING)
        around = np.arange(-_REACH, _REACH + 1)
        self._around = np.stack(np.meshgrid(around, around, indexing="ij"), axis=-1).reshape(-1, 2)

    def add(self, view: View, origin: Array) -> None:
        """Take in a scan; ``origin`` (2,) of the laser in O [m]."""
        self._new.append((view, origin))

    def _work_in(self, view: View, origin: Array) -> None:
        cells = np.floor(origin / _CELL).astype(np.int64) + self._around
        middle: Array = np.asarray((cells + 0.5) * _CELL, dtype=np.float64)
        i, j = cells[view.through(middle, 0.0)].T
        self._place[i % _CELLS, j % _CELLS] = _number(i, j)

    def at(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """(n, m) whether floor was seen at places given by their x (n,) and y (m,) in O [m]."""
        while self._new:
            self._work_in(*self._new.popleft())
        i = np.floor(x / _CELL).astype(np.int64)[:, None]
        j = np.floor(y / _CELL).astype(np.int64)[None, :]
        return self._place[i % _CELLS, j % _CELLS] == _number(i, j)


def _number(i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.int64]:
    return (i + (1 << 20)) * (1 << 22) + j + (1 << 20)
