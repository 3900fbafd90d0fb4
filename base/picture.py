"""What the laser shows: the newest scan as points in O, and what of earlier ones still holds."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from base.behaviour import Senses
from base.movers import Movers
from base.remembered import Remembered
from base.seen import Seen
from base.view import View
from deploy.sensors import Laser
from services.messages import Array, Scan

SILENT = 0.35
"""Age of the newest scan beyond which the laser is silent [s]: three scans missed."""
_BLIND = 0.05  # share of the beams that end inside the platform beyond which it is blinded
_SAME = 0.06  # neighbouring beams nearer than this see the same surface [m]
_BEFORE = (3, 5, 9)  # scans ago, that tell what floor was free
_FREE = 0.1  # a beam that went on for this long behind a place met nothing there [m]
_EMPTY = np.zeros((0, 2))


class Picture:
    """Points in O of the newest scan with their velocities, and a memory of standing ones.

    Ask ``look`` at every step: it needs the poses between scans, because a scan is older than the
    estimate.

    Args:
        laser: description.
        radius: of the platform [m]; beams that end within it are blinded.

    Attributes:
        scan: newest taken in, None before the first.
        trouble: why the laser must not be trusted; empty if it may.
        points: (n, 2) of the newest scan, in O, where they were at ``scan.t``.
        velocity: (n, 2) of these points, in O; zero for what is not seen to move.
        pose: (3,) X_OB at ``scan.t``.
        seen: floor that beams went over.
    """

    def __init__(self, laser: Laser, radius: float) -> None:
        self._laser, self._radius = laser, radius
        self._poses: deque[tuple[float, float, float, float]] = deque(maxlen=16)
        self._movers = Movers()
        self._remembered = Remembered()
        self.seen = Seen()
        self._views: deque[View] = deque(maxlen=max(_BEFORE))
        self.scan: Scan | None = None
        self.trouble = "no scan yet"
        self.points, self.velocity, self.pose = _EMPTY, _EMPTY, np.zeros(3)

    @property
    def remembered(self) -> Array:
        """(m, 2) standing points in O, of this scan and earlier ones."""
        return self._remembered.points

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
        self.velocity = self._movers.track(scan.t, self.points, self._was_free())
        view = View(scan, origin, float(pose[2]))
        self._views.append(view)
        self.seen.add(view, origin)
        self._remembered.forget(view)
        self._remembered.add(scan.t, self.points[~self.moving])

    def _was_free(self) -> NDArray[np.bool_]:
        """(n,) which of ``points`` are where a while ago there was nothing."""
        free = np.zeros(len(self.points), dtype=bool)
        for before in _BEFORE:
            if before <= len(self._views):
                free |= self._views[-before].through(self.points, _FREE)
        return free

    def _pose_at(self, t: float, senses: Senses) -> Array:
        history = np.array(self._poses)
        if t <= history[-1, 0] and t >= history[0, 0]:
            return np.array([np.interp(t, history[:, 0], history[:, i]) for i in (1, 2, 3)])
        return senses.estimate.pose + (t - senses.estimate.t) * senses.estimate.velocity


def _smooth(ranges: Array) -> Array:
    """Mean of three neighbouring beams where they see the same surface."""
    before, after = np.roll(ranges, 1), np.roll(ranges, -1)
    same = (np.abs(before - ranges) < _SAME) & (np.abs(after - ranges) < _SAME)
    return np.where(same, (before + ranges + after) / 3, ranges)
