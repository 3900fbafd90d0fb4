"""Stand square to a surface at a given distance, by the laser alone."""

from __future__ import annotations

import math

import numpy as np

from base.approach import Approach
from base.behaviour import Senses, Vote
from base.line import Line, fit
from base.picture import Picture
from base.planar import difference, rotate, wrap
from services.messages import Array

_SECTOR = math.radians(35.0)  # either side of where the surface is looked for
_FEWEST = 12  # points of a surface
_ROUGHEST = 0.03  # rms of the points about their line [m]
_PATIENCE = 2.0  # without a surface before it is said so [s]
_SCANS = 25  # averaged at the end
_NEAR = (0.02, 0.02)  # of the place, where averaging begins [m, rad]


class Dock:
    """Fits a line to the scan around where the surface is, and goes to the pose in front of it.

    Near that pose it averages the line over the scans of a few seconds: one scan tells the
    direction no better than a quarter of a degree. The line is kept in O, so the platform may move
    meanwhile. Along the surface it stays where it starts.

    Args:
        distance: from the middle of B to the surface [m].
        bearing: in B where the surface is to be, and is looked for at first [rad].
        picture: of the laser.
        tolerance: on arrival, of the distance [m] and of the direction [rad].
    """

    name = "dock"

    def __init__(
        self,
        distance: float,
        bearing: float,
        picture: Picture,
        tolerance: tuple[float, float] = (0.0015, 0.0015),
    ) -> None:
        self._distance, self._bearing, self._picture = distance, bearing, picture
        self._tolerance = tolerance
        self._approach = Approach(speed=0.3, turn=0.4, deceleration=0.25, gain=1.0)
        self._line: Line | None = None
        self._averaged = 0
        self._seen: float | None = None
        self._state = "looking"

    @property
    def state(self) -> str:
        """``looking``, ``docking``, ``measuring``, ``docked``, or ``blocked`` without a surface."""
        return self._state

    @property
    def line(self) -> Line | None:
        """The surface in O as believed."""
        return self._line

    def vote(self, now: float, senses: Senses) -> Vote:
        """The velocity to the pose in front of the surface; zero there, and while there is none."""
        self._seen = now if self._seen is None else self._seen
        pose = senses.estimate.pose
        if self._picture.look(now, senses) and not self._picture.trouble:
            self._measure(now, pose)
        if now - self._seen > _PATIENCE:
            self._line, self._state = None, "blocked"
        if self._line is None:
            lost = "no surface where it is looked for" if self._state == "blocked" else ""
            return Vote(np.zeros(3), reason=lost)
        error = self._error(pose)
        size = abs(error[0]), abs(error[2])
        if self._averaged < _SCANS:
            self._state = "measuring" if self._averaged else "docking"
        elif self._state != "docked" or _beyond(size, self._tolerance, 3.0):
            self._state = "docking" if _beyond(size, self._tolerance, 1.0) else "docked"
        if self._state == "docked":
            return Vote(np.zeros(3))
        normal = self._line.direction
        forward = rotate(normal, np.array([error[0], 0.0, error[2]]))
        return Vote(self._approach.velocity(forward, pose[2]))

    def _error(self, pose: Array) -> Array:
        """(3,) along the surface's normal [m], zero, and of the heading [rad]."""
        assert self._line is not None
        line = self._line
        heading = wrap(line.direction + math.pi - self._bearing - pose[2])
        return np.array([self._distance - line.height(pose[:2]), 0.0, heading])

    def _measure(self, now: float, pose: Array) -> None:
        toward = pose[2] + self._bearing
        if self._line is not None:
            toward = self._line.direction + math.pi
        points = self._picture.points[~self._picture.moving]
        away = points - pose[:2]
        off = np.arctan2(away[:, 1], away[:, 0]) - toward
        sector = np.abs(np.mod(off + math.pi, 2 * math.pi) - math.pi) < _SECTOR
        line, rough, used = fit(points[sector], pose[:2])
        if line is None or used < _FEWEST or rough > _ROUGHEST:
            return
        self._seen = now
        if self._line is None:
            self._line = line
            return
        error = np.abs(difference(np.zeros(3), self._error(pose)))
        if _beyond((error[0], error[2]), _NEAR, 1.0):
            self._averaged = 0
            self._line = self._line.blend(line, 0.4, pose[:2])
            return
        self._averaged += 1
        gain = 1.0 / min(self._averaged, 2 * _SCANS)
        self._line = self._line.blend(line, gain, pose[:2])


def _beyond(size: tuple[float, float], tolerance: tuple[float, float], scale: float) -> bool:
    return size[0] > scale * tolerance[0] or size[1] > scale * tolerance[1]
