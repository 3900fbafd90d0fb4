"""Turn to the goal, drive to it, turn to its heading: for a platform that cannot move sideways.

Table I of Hart, Ou, Sweeney and Grupen (2006), with what it leaves open: errors are wrapped angles
relative to the platform's heading, there is a state for having arrived, and each boundary has a
hysteresis, since the bearing of a goal is anything once the platform stands on it.
"""

from __future__ import annotations

import math

import numpy as np

from base.approach import Approach
from base.behaviour import Senses, Vote
from base.planar import difference, wrap
from services.messages import Array

COURSE = 0.05
"""Bearing error at which a turn gives way to the drive [rad] ..."""
OFF_COURSE = 0.5
"""... and beyond which a drive gives way to a turn [rad]."""
BACKING = 1.0
"""What lies straight behind, no farther than this [m] ..."""
STRAIGHT = 0.3
"""... and asks for no other heading than this [rad], is backed up to."""
STEERED = 0.15
"""Nearer to the goal than this the drive is steered less and less, in vain as it is [m]."""
PASSED = 0.5
"""Share of the tolerance left ahead at which a drive ends."""


class TurnDriveTurn:
    """Drive to a pose by a turn, a straight drive and a turn.

    It sets out again only when moved to thrice the tolerance.

    Args:
        goal: (3,) X_OB to reach [m, m, rad]; a heading that is not finite asks for none.
        approach: how fast.
        tolerance: of x, y together [m] and of the heading [rad].
    """

    name = "drive_to"

    def __init__(
        self,
        goal: Array,
        approach: Approach | None = None,
        tolerance: tuple[float, float] = (0.02, 0.02),
    ) -> None:
        self._goal = np.array(goal, dtype=np.float64)
        self._approach = approach or Approach()
        self._tolerance = tolerance
        self._driving = False
        self._there = False
        self._facing = False
        self._backs: bool | None = None

    @property
    def state(self) -> str:
        """``driving``, whatever the part of it, or ``arrived``."""
        return "arrived" if self._there and self._facing else "driving"

    def vote(self, now: float, senses: Senses) -> Vote:
        """The velocity of the part that is due, none of it sideways; exactly zero once there."""
        pose = senses.estimate.pose
        distance, bearing = range_and_bearing(self._goal, pose)
        if self._backs is None:
            self._backs = behind(self._goal, pose)
        if self._backs:
            bearing = wrap(bearing + math.pi)
        self._look(distance, bearing, float(pose[2]))
        if not self._there:
            if not self._driving:
                return Vote(turning(self._approach, bearing), reason="turns to the goal")
            velocity = driving(self._approach, distance, bearing)
            if self._backs:
                velocity = velocity * np.array([-1.0, 1.0, 1.0])
            return Vote(velocity, reason="drives to the goal")
        if self._facing:
            return Vote(np.zeros(3))
        turn = wrap(float(self._goal[2] - pose[2]))
        return Vote(turning(self._approach, turn), reason="turns to the goal's heading")

    def _look(self, distance: float, bearing: float, heading: float) -> None:
        """Decide which part is due."""
        near, straight = self._tolerance
        if self._there:
            self._there = distance <= 3 * near
        else:
            ahead = distance * math.cos(bearing)
            self._there = distance <= near and (ahead <= PASSED * near or not self._driving)
        if not self._there:
            self._facing = False
            limit = OFF_COURSE if self._driving else COURSE
            self._driving = abs(bearing) <= limit
            return
        self._driving = False
        if not math.isfinite(self._goal[2]):
            self._facing = True
            return
        turn = abs(wrap(float(self._goal[2] - heading)))
        self._facing = turn <= (3 if self._facing else 1) * straight


def behind(goal: Array, pose: Array) -> bool:
    """Whether a goal (3,) lies near behind a pose (3,) and asks for its heading: then back up."""
    distance, bearing = range_and_bearing(goal, pose)
    if not math.isfinite(goal[2]) or abs(wrap(float(goal[2] - pose[2]))) > STRAIGHT:
        return False
    return distance < BACKING and abs(wrap(bearing + math.pi)) < STRAIGHT


def range_and_bearing(goal: Array, pose: Array) -> tuple[float, float]:
    """Distance [m] of a goal (3,) from a pose (3,), both in O, and its bearing from ahead [rad]."""
    ahead = np.array([goal[0], goal[1], 0.0])
    error = difference(ahead, np.array([pose[0], pose[1], 0.0]))
    bearing = wrap(math.atan2(error[1], error[0]) - float(pose[2]))
    return math.hypot(error[0], error[1]), bearing


def turning(approach: Approach, angle: float) -> Array:
    """V_OB_B (3,) that turns by what is left of ``angle`` [rad] on the spot."""
    return approach.velocity(np.array([0.0, 0.0, angle]), 0.0)


def driving(approach: Approach, distance: float, bearing: float) -> Array:
    """V_OB_B (3,) straight ahead to a point at ``distance`` [m], steered towards its bearing [rad].

    The speed is that for what is left ahead, so that a point abeam is passed at rest.
    """
    ahead = max(0.0, distance * math.cos(bearing))
    steer = bearing * min(1.0, distance / STEERED)
    return approach.velocity(np.array([ahead, 0.0, steer]), 0.0)
