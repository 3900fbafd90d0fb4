"""One scan and where it was taken: what floor it shows to be free."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from services.messages import Array, Scan


class View:
    """A scan as seen from its place.

    Args:
        scan: with at least one beam.
        origin: (2,) of the laser in O [m].
        heading: of the laser in O [rad].

    Attributes:
        t: of the scan [s].
    """

    def __init__(self, scan: Scan, origin: Array, heading: float) -> None:
        self.t = scan.t
        self._origin, self._start = origin, heading + scan.start
        self._increment = max(scan.increment, 1e-6)
        n = len(scan.ranges)
        self._full = n * scan.increment > 2 * math.pi - 1.5 * scan.increment
        ends = np.zeros(1) if n == 0 else scan.ranges
        # of each beam and its neighbours the shortest: at an edge one of them slips past
        self._nearest = np.minimum(ends, np.minimum(np.roll(ends, 1), np.roll(ends, -1)))

    def through(self, points: Array, behind: float) -> NDArray[np.bool_]:
        """Which of these places beams went through, so that nothing was there.

        Args:
            points: (n, 2) in O [m].
            behind: how much further the beams have to go [m].
        """
        away = points - self._origin
        turn = np.arctan2(away[:, 1], away[:, 0]) - self._start
        beam = np.rint(np.mod(turn, 2 * math.pi) / self._increment).astype(int)
        n = len(self._nearest)
        seen = (beam < n) | self._full
        return seen & (self._nearest[beam % n] > np.hypot(away[:, 0], away[:, 1]) + behind)
