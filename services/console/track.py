"""What a plot shows: rows of values over the last minute, thinned to what an eye can follow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RATE = 30.0
"""Rows kept a second [Hz]."""
SPAN = 75.0
"""How much is kept [s]: a window of 15 s can be taken back by 60 s."""


class Track:
    """Rows of values with their time, the oldest of which are overwritten.

    Args:
        columns: values in a row.
    """

    def __init__(self, columns: int) -> None:
        self._rows = np.full((round(SPAN * RATE), columns + 1), np.nan)
        self._count = 0
        self._last = -float("inf")

    def add(self, t: float, values: Sequence[float] | Array) -> None:
        """Keep a row, unless one was kept less than 1/RATE ago; time that goes back starts anew."""
        if t < self._last:
            self.clear()
        if t < self._last + 1.0 / RATE - 1e-6:
            return
        row = self._rows[self._count % len(self._rows)]
        row[0], row[1:] = t, values
        self._count, self._last = self._count + 1, t

    def clear(self) -> None:
        """Forget everything."""
        self._count, self._last = 0, -float("inf")

    def window(self, start: float, end: float) -> tuple[Array, ...]:
        """Times and columns of the rows between two instants [s]; two rows of NaN if none is."""
        if self._count <= len(self._rows):
            rows = self._rows[: self._count]
        else:
            rows = np.roll(self._rows, -(self._count % len(self._rows)), axis=0)
        first, last = np.searchsorted(rows[:, 0], (start, end), side="left")
        rows = rows[first:last]
        if not len(rows):
            rows = np.full((2, self._rows.shape[1]), np.nan)
            rows[:, 0] = start, end
        return tuple(np.ascontiguousarray(column) for column in rows.T)
