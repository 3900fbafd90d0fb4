"""What the laser shows: the newest scan as points in O, and what of earlier ones still holds."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from base.behaviour import Senses
from base.movers import Movers
from deploy.robot import Laser
from services.messages import Array, Scan

SILENT = 0.35
"""Age of the newest scan beyond which the laser is silent [s]: three scans missed."""
_BLIND = 0.05  # share of the beams that end inside the platform beyond which it is blinded
_CELL = 0.05  # of the memory: one remembered point each [m]
_SAME = 0.06  # neighbouring beams nearer than this see the same surface [m]
_THROUGH = 0.15  # a beam that goes on for this long behind a point has not met it [m]
_MEMORY = 60.0  # after which a point not seen again is forgotten [s]
_MOST = 20  # scans that a remembered point is the mean of at most
_EMPTY = np.zeros((0, 2))


class Picture:
    """Points in O of the newest scan with their velocities, and a memory of standing ones.

    A remembered point is the mean of what was seen in its cell, so that noise averages out; it is
    forgotten when a beam goes through it. Ask ``look`` at every step: it needs the poses between
    scans, because a scan is older than the estimate.

    Args:
        laser: description.
        radius: of the platform [m]; beams that end within it are blinded.

    Attributes:
        scan: newest taken in, None before the first.
        trouble: why the laser must not be trusted; empty if it may.
        points: (n, 2) of the newest scan, in O, where they were at ``scan.t``.
        velocity: (n, 2) of these points, in O; zero for what is not seen to move.
        pose: (3,) X_OB at ``scan.t``.
        remembered: (m, 2) standing points in O, of this scan and earlier ones.
    """

    def __init__(self, laser: Laser, radius: float) -> None:
        self._laser, self._radius = laser, radius
        self._poses: deque[tuple[float, float, float, float]] = deque(maxlen=16)
        self._movers = Movers()
        self._memory: dict[tuple[int, int], tuple[float, float, float, float]] = {}
        self.scan: Scan | None = None
        self.trouble = "no scan yet"
        self.points, self.velocity, self.pose = _EMPTY, _EMPTY, np.zeros(3)
        self.remembered = _EMPTY

    def look(self, now: float, senses: Senses) -> bool:
        """Take in what is new; whether there was a new scan."""
        estimate = senses.estimate
        if not self._poses or estimate.t > self._poses[-1][0]:
            self._poses.append((estimate.t, *estimate.pose.tolist()))
        scan = senses.scan
        new = scan is not None and (self.scan is None or scan.t > self.scan.t)
        if scan is not None and new:
            self._take(scan, senses)
        self.trouble = self._trouble(now)
        return new

    @property
    def moving(self) -> NDArray[np.bool_]:
        """(n,) which of ``points`` move."""
        return (self.velocity != 0).any(axis=1)

    def _trouble(self, now: float) -> str:
        if self.scan is None:
            return "no scan yet"
        age = now - self.scan.t
        if age > SILENT:
            return f"laser silent for {age:.1f} s"
        inside = np.count_nonzero(self.scan.ranges < 0.8 * self._radius)
        if not len(self.scan.ranges) or inside > _BLIND * len(self.scan.ranges):
            return "laser blinded"
        return ""

    def _take(self, scan: Scan, senses: Senses) -> None:
        self.scan = scan
        self.pose = pose = self._pose_at(scan.t, senses)
        ranges = _smooth(scan.ranges)
        bearing = pose[2] + scan.start + scan.increment * np.arange(len(ranges))
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x, y = self._laser.position
        origin = pose[:2] + np.array([c * x - s * y, s * x + c * y])
        hit = (scan.ranges < scan.farthest - 1e-3) & (scan.ranges >= 0.8 * self._radius)
        direction = np.column_stack([np.cos(bearing), np.sin(bearing)])
        self.points = origin + ranges[hit, None] * direction[hit]
        self.velocity = self._movers.track(scan.t, self.points)
        self._forget(scan, origin, pose[2])
        self._remember(scan.t)

    def _pose_at(self, t: float, senses: Senses) -> Array:
        history = np.array(self._poses)
        if t <= history[-1, 0] and t >= history[0, 0]:
            return np.array([np.interp(t, history[:, 0], history[:, i]) for i in (1, 2, 3)])
        return senses.estimate.pose + (t - senses.estimate.t) * senses.estimate.velocity

    def _forget(self, scan: Scan, origin: Array, heading: float) -> None:
        if not self._memory:
            return
        keys, values = list(self._memory), np.array(list(self._memory.values()))
        away = values[:, :2] - origin
        distance = np.hypot(away[:, 0], away[:, 1])
        turn = np.arctan2(away[:, 1], away[:, 0]) - heading - scan.start
        beam = np.rint(np.mod(turn, 2 * math.pi) / max(scan.increment, 1e-6)).astype(int)
        n = len(scan.ranges)
        full = n * scan.increment > 2 * math.pi - 1.5 * scan.increment
        seen = (beam < n) | full
        beam = np.mod(beam, n)
        near = np.minimum(
            scan.ranges[beam], np.minimum(scan.ranges[beam - 1], scan.ranges[(beam + 1) % n])
        )
        gone = (seen & (near > distance + _THROUGH)) | (values[:, 3] < scan.t - _MEMORY)
        for i in np.flatnonzero(gone):
            del self._memory[keys[i]]

    def _remember(self, t: float) -> None:
        standing = self.points[~self.moving]
        for point in standing.tolist():
            key = (math.floor(point[0] / _CELL), math.floor(point[1] / _CELL))
            x, y, n, _ = self._memory.get(key, (0.0, 0.0, 0.0, 0.0))
            keep = min(n, _MOST - 1.0)
            x, y = (keep * x + point[0]) / (keep + 1), (keep * y + point[1]) / (keep + 1)
            self._memory[key] = (x, y, keep + 1, t)
        known = list(self._memory.values())
        self.remembered = np.array(known)[:, :2] if known else _EMPTY


def _smooth(ranges: Array) -> Array:
    """Mean of three neighbouring beams where they see the same surface."""
    before, after = np.roll(ranges, 1), np.roll(ranges, -1)
    same = (np.abs(before - ranges) < _SAME) & (np.abs(after - ranges) < _SAME)
    return np.where(same, (before + ranges + after) / 3, ranges)
