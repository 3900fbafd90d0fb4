"""Which of the things that a laser sees move, and how: told from one scan to the next."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from services.messages import Array

_GAP = 0.25  # between neighbouring points of different things [m]
_WIDEST = 0.9  # of what is tracked; walls are not [m]
_STRAY = 0.35  # from where it was expected, of the same thing [m]
_GAINS = (0.6, 0.35)  # of position and velocity, per scan
_SLOWEST = 0.25  # that counts as moving; less may be a thing seen from another side [m/s]
_FASTEST = 2.0  # [m/s]
_SCANS = 3  # that a thing is followed for before it is believed to move


@dataclass(slots=True)
class _Track:
    x: float
    y: float
    vx: float
    vy: float
    scans: int


class Movers:
    """Follows small things by an alpha-beta filter of the middle of what is seen of them."""

    def __init__(self) -> None:
        self._tracks: list[_Track] = []
        self._t = 0.0

    def track(self, t: float, points: Array) -> Array:
        """The velocity of each point of a scan.

        Args:
            t: of the scan [s].
            points: (n, 2) in O, in the order of their bearings.

        Returns:
            (n, 2) in O [m/s]; zero for what stands or is not known to move.
        """
        velocity = np.zeros((len(points), 2))
        elapsed, self._t = t - self._t, t
        fresh: list[_Track] = []
        if elapsed > 0.5:
            self._tracks = []
        for first, last in _things(points):
            middle = points[first:last].mean(axis=0)
            track = self._follow(float(middle[0]), float(middle[1]), elapsed)
            if track.scans == 0 and last - first < 3:
                continue
            fresh.append(track)
            speed = math.hypot(track.vx, track.vy)
            if track.scans >= _SCANS and _SLOWEST < speed < _FASTEST:
                velocity[first:last] = track.vx, track.vy
        self._tracks = fresh
        return velocity

    def _follow(self, x: float, y: float, elapsed: float) -> _Track:
        best, nearest = None, _STRAY
        for track in self._tracks:
            away = math.hypot(x - track.x - track.vx * elapsed, y - track.y - track.vy * elapsed)
            if away < nearest:
                best, nearest = track, away
        if best is None:
            return _Track(x, y, 0.0, 0.0, 0)
        self._tracks.remove(best)
        px, py = best.x + best.vx * elapsed, best.y + best.vy * elapsed
        a, b = _GAINS
        if best.scans == 0:  # the first difference is the best guess there is
            a, b = 1.0, 1.0
        return _Track(
            px + a * (x - px),
            py + a * (y - py),
            best.vx + b * (x - px) / elapsed,
            best.vy + b * (y - py) / elapsed,
            best.scans + 1,
        )


def _things(points: Array) -> list[tuple[int, int]]:
    """First and one past the last index of runs of points that belong together and are small."""
    if len(points) < 2:
        return []
    step = np.diff(points, axis=0)
    cuts = np.flatnonzero(np.hypot(step[:, 0], step[:, 1]) > _GAP) + 1
    edges = [0, *cuts.tolist(), len(points)]
    out = []
    for first, last in pairwise(edges):
        span = points[first:last].max(axis=0) - points[first:last].min(axis=0)
        if math.hypot(span[0], span[1]) < _WIDEST:
            out.append((first, last))
    return out
