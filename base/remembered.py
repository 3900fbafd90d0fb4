"""Standing points that the laser has met: one a cell, forgotten when a beam goes through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from base.view import View
from services.messages import Array

_CELL = 0.05  # one remembered point each [m]
_THROUGH = 0.15  # a beam that goes on for this long behind a point has not met it [m]
_MEMORY = 60.0  # after which a point not seen again is forgotten [s]
_MOST = 20  # scans that a remembered point is the mean of at most
_FAR = 1 << 20  # cells either side of the middle of O


class Remembered:
    """A memory of points, each the mean of what was seen in its cell, so that noise averages out.

    Attributes:
        points: (m, 2) in O [m].
    """

    def __init__(self) -> None:
        self.points: Array = np.zeros((0, 2))
        self._keys: NDArray[np.int64] = np.zeros(0, dtype=np.int64)  # ascending
        self._scans: Array = np.zeros(0)  # that each is the mean of
        self._seen: Array = np.zeros(0)

    def forget(self, view: View) -> None:
        """Drop what a beam goes through, and what was last seen long ago."""
        if not len(self._keys):
            return
        gone = view.through(self.points, _THROUGH) | (self._seen < view.t - _MEMORY)
        if gone.any():
            self._keep(~gone)

    def add(self, t: float, points: Array) -> None:
        """Remember points of a scan.

        Args:
            t: of the scan [s].
            points: (n, 2) in O [m].
        """
        if not len(points):
            return
        cells = np.floor(points / _CELL).astype(np.int64) + _FAR
        fresh, place, count = np.unique(
            cells[:, 0] * (2 * _FAR) + cells[:, 1], return_inverse=True, return_counts=True
        )
        mean = np.column_stack(
            [np.bincount(place, points[:, i], len(fresh)) / count for i in (0, 1)]
        )
        known = np.isin(fresh, self._keys, assume_unique=True)
        old = np.searchsorted(self._keys, fresh[known])
        keep = np.minimum(self._scans[old], _MOST - 1.0)[:, None]
        self.points[old] = (keep * self.points[old] + mean[known]) / (keep + 1.0)
        self._scans[old], self._seen[old] = keep[:, 0] + 1.0, t
        new = ~known
        if new.any():
            keys = np.concatenate([self._keys, fresh[new]])
            self.points = np.vstack([self.points, mean[new]])
            self._scans = np.concatenate([self._scans, np.ones(np.count_nonzero(new))])
            self._seen = np.concatenate([self._seen, np.full(np.count_nonzero(new), t)])
            self._keys = keys
            self._keep(np.argsort(keys, kind="stable"))

    def _keep(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> None:
        self._keys, self._scans = self._keys[which], self._scans[which]
        self._seen, self.points = self._seen[which], self.points[which]
