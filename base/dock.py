"""Stand square to a surface at a given distance, by the laser alone."""

from __future__ import annotations

import math

import numpy as np

from base.approach import Approach
from base.behaviour import Senses, Vote
from base.line import Line, fit
from base.picture import Picture
from base.planar import rotate, wrap
from base.settle import Settle
from services.messages import Array

_SECTOR = math.radians(35.0)  # either side of where the surface is looked for
_FEWEST = 12  # points of a surface
_ROUGHEST = 0.03  # rms of the points about their line [m]
_PATIENCE = 2.0  # without a surface before it is said so [s]
_SCANS = 20  # averaged at rest before the last millimetres
_NEAR = (0.02, 0.03)  # of the place, where it stands and averages [m, rad]


class Dock:
    """Fits a line to the scan around where the surface is, and goes to the pose in front of it.

    Near that pose it stands and averages the line over the scans of two seconds: one scan tells the
    direction no better than a quarter of a degree. The line is kept in O, and averaged on. Along
    the surface it stays where it starts.

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
        self._settle = Settle(tolerance)
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
        error = rotate(self._line.direction, error)
        if not self._averaged:
            self._state = "docking"
            return Vote(self._approach.velocity(error, pose[2]))
        if self._averaged < _SCANS:
            self._state = "measuring"
            return Vote(np.zeros(3))
        wanted = self._settle.velocity(now, error, senses.estimate.velocity, pose[2])
        self._state = "docked" if self._settle.done else "docking"
        return Vote(wanted)

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
        error = np.abs(self._error(pose))
        far = 3.0 if self._averaged else 1.0
        if error[0] > far * _NEAR[0] or error[2] > far * _NEAR[1]:
            self._averaged = 0
            self._line = self._line.blend(line, 0.4, pose[:2])
            return
        self._averaged += 1
        gain = 1.0 / min(self._averaged, 3 * _SCANS)
        self._line = self._line.blend(line, gain, pose[:2])
