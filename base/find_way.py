"""To a pose among obstacles by the shortest way free of what the laser shows, each scan anew."""

from __future__ import annotations

import math

import numpy as np

from base.approach import Approach
from base.behaviour import Senses, Vote
from base.picture import Picture
from base.planar import difference, rotate
from base.way_map import Way, WayMap
from services.messages import Array

_PATIENCE = 2.0  # without a way before it is called blocked [s]
_AHEAD = 1.2  # along the way to the point steered for, at most [m]
_FORESIGHT = 1.6  # what moves is taken to go on for this long [s]
_EDGE = 0.06  # of what moves, between points that stand for it [m]


class FindWay:
    """Steers for the furthest point of the way that can be reached straight; slower where narrow.

    What was never seen counts as free, so the way may lead into a dead end; once seen, that is
    remembered. Without a way it stands still, says why after ``_PATIENCE``, and goes on by itself
    when one opens.

    Args:
        goal: (3,) X_OB to reach [m, m, rad].
        picture: of the laser.
        radius: of the platform [m].
        approach: how fast.
        tolerance: of x, y together [m] and of the heading [rad] on arrival.
    """

    name = "find_way"

    def __init__(
        self,
        goal: Array,
        picture: Picture,
        radius: float,
        approach: Approach | None = None,
        tolerance: tuple[float, float] = (0.005, 0.01),
    ) -> None:
        self._goal = np.array(goal, dtype=np.float64)
        self._picture, self._radius = picture, radius
        self._approach = approach or Approach(speed=0.7, turn=0.6, deceleration=0.5)
        self._tolerance = tolerance
        self._map = WayMap(fits=radius + 0.02, comfort=radius + 0.25)
        self._way: Way | None = None
        self._lost_since: float | None = None
        self._state, self._reason = "driving", ""

    @property
    def state(self) -> str:
        """``driving``, ``arrived`` or ``blocked``."""
        return self._state

    @property
    def way(self) -> Way | None:
        """The newest, None before the first scan; for pictures."""
        return self._way

    def vote(self, now: float, senses: Senses) -> Vote:
        """The velocity along the way; zero once there, and where there is none."""
        picture, pose = self._picture, senses.estimate.pose
        new = picture.look(now, senses)
        if picture.scan is None:
            return Vote(np.zeros(3), reason="no scan yet")
        error = difference(self._goal, pose)
        scale = 3.0 if self._state == "arrived" else 1.0
        if (
            math.hypot(error[0], error[1]) <= scale * self._tolerance[0]
            and abs(error[2]) <= scale * self._tolerance[1]
        ):
            self._state, self._lost_since = "arrived", None
            return Vote(np.zeros(3))
        if new or self._way is None:
            self._search(now, pose)
        if self._lost_since is not None and now - self._lost_since > _PATIENCE:
            self._state = "blocked"
            return Vote(np.zeros(3), reason=self._reason)
        self._state = "driving"
        if self._lost_since is not None:
            return Vote(np.zeros(3), reason=self._reason)
        return Vote(self._along(pose, error))

    def _search(self, now: float, pose: Array) -> None:
        picture = self._picture
        way = self._map.search(pose[:2], self._goal[:2], picture.remembered, self._passing(now))
        self._way = way
        if way.blocked == 0:
            self._lost_since, self._reason = None, ""
            return
        self._reason = (
            "the goal lies in or too near to an obstacle"
            if way.ends_blocked
            else "no way to the goal is wide enough"
        )
        if self._lost_since is None:
            self._lost_since = now

    def _passing(self, now: float) -> Array:
        """(k, 2) where what moves is and will be."""
        picture = self._picture
        assert picture.scan is not None
        points, velocity = picture.points[picture.moving], picture.velocity[picture.moving]
        if not len(points):
            return points
        speed = float(np.hypot(velocity[:, 0], velocity[:, 1]).max())
        steps = max(2, math.ceil(speed * _FORESIGHT / _EDGE))
        ahead = now - picture.scan.t + np.linspace(0.0, _FORESIGHT, steps)
        return (points + ahead[:, None, None] * velocity).reshape(-1, 2)

    def _along(self, pose: Array, error: Array) -> Array:
        """(3,) V_OB_B towards the point steered for."""
        way = self._way
        assert way is not None
        step = np.diff(way.points, axis=0)
        passed = np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))])
        nearest = int(np.argmin(np.hypot(*(way.points[:40] - pose[:2]).T)))
        passed = passed - passed[nearest]
        target = self._furthest(way, passed, nearest, pose)
        toward = way.points[target] - pose[:2]
        length = math.hypot(toward[0], toward[1])
        left = length + float(passed[-1] - passed[target])
        fast = self._approach.velocity(np.array([left, 0.0, error[2]]), 0.0)
        room = float(way.clearance[nearest : target + 1].min()) - self._radius
        speed = min(float(fast[0]), 0.2 + 1.5 * max(room, 0.0)) if left > 0.2 else float(fast[0])
        scale = speed / length if length > 1e-6 else 0.0
        return rotate(-pose[2], np.array([scale * toward[0], scale * toward[1], fast[2]]))

    def _furthest(self, way: Way, passed: Array, nearest: int, pose: Array) -> int:
        """Index of the furthest point that a straight line leads to without getting narrower."""
        last = int(np.searchsorted(passed, _AHEAD, side="right")) - 1
        near = self._near(pose)
        for target in range(max(last, nearest + 1), nearest + 1, -2):
            target = min(target, len(passed) - 1)
            if not len(near):
                return target
            needed = min(
                float(way.clearance[nearest : target + 1].min()) - 0.02, self._radius + 0.2
            )
            if _clear(pose[:2], way.points[target], near) >= needed:
                return target
        return min(nearest + 2, len(passed) - 1)

    def _near(self, pose: Array) -> Array:
        points = np.vstack([self._picture.remembered, self._picture.points])
        away = points - pose[:2]
        return points[np.hypot(away[:, 0], away[:, 1]) < _AHEAD + self._radius + 0.2]


def _clear(start: Array, end: Array, points: Array) -> float:
    """Least distance of points (m, 2) from a straight line [m]; those behind its start are out."""
    along = end - start
    length2 = float(along @ along)
    if length2 < 1e-12:
        return math.inf
    away = points - start
    share = away @ along / length2
    ahead = share > 0
    if not ahead.any():
        return math.inf
    off = away[ahead] - np.minimum(share[ahead], 1.0)[:, None] * along
    return float(np.sqrt((off * off).sum(axis=1).min()))
