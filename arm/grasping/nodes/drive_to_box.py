"""Drive_to_box: have the platform go to a place before the box."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from arm.grasping.hands import Hands, Move
from arm.grasping.nodes.node import Step
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

Array = NDArray[np.float64]

STILL = 0.03
"""Arrived no faster than this [m/s, rad/s] ..."""
STILL_TIME = 0.2
"""... for this long [s]."""
PATIENCE = 4.0
"""A platform that stands elsewhere for this long is taken to be held up [s]."""
MOVED = 0.10, 0.15
"""A goal that comes to lie elsewhere, by better sight, is asked for anew [m, rad]."""


class DriveToBox:
    """Φ_drive of Table II: a pose before the box, from where the box is believed to be.

    ``Side = towards``: on the line from the box to the robot; ``front``: in front of the face by
    which it is taken (``Faces``), straight unless it was turned; ``back``: straight back from where
    the robot looks. Control law: arms towards their rest, the platform's own turn, drive and turn.
    Goal region: within ``Tolerance`` of the goal, at rest.
    Domain: the way free, the arms clear of the box.
    """

    needs_box = True

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._distance = float(values["Distance"])
        self._side = str(values["Side"])
        self._tolerance = float(values["Tolerance"])
        self._clock = Clock(float(values["Timeout"]))
        self._goal: Array | None = None

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Fix the goal, straight back once the platform has come to rest."""
        hands.reset()
        self._goal = None if self._side == "back" else self._place(scene)
        self._still = self._since = 0.0

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Arrived at the goal, Blocked when the platform does not come nearer."""
        slow = float(np.abs(scene.base.velocity).max()) < STILL
        posture = Move(None) if self._side == "back" else Move(hands.posture)
        if self._goal is None:
            if not slow and self._since < PATIENCE:  # where a turning platform looks is not back
                self._since += scene.dt
                return Step(posture)
            self._goal, self._since = self._place(scene), 0.0
        if self._side == "front":  # along the way the box is seen better and better
            place = self._place(scene)
            moved = place - self._goal
            off = math.hypot(moved[0], moved[1])
            if off > MOVED[0] or abs(math.remainder(moved[2], math.tau)) > MOVED[1]:
                self._goal = place
        error = self._goal - scene.base.pose
        distance = math.hypot(error[0], error[1])
        turn = abs(math.remainder(error[2], math.tau))
        there = distance < self._tolerance and turn < 2.0 * self._tolerance
        self._still = self._still + scene.dt if there and slow else 0.0
        self._since = self._since + scene.dt if slow and not there else 0.0
        event, reason = None, ""
        if self._still >= STILL_TIME:
            event = "Arrived"
        elif self._since >= PATIENCE:
            event = "Blocked"
            reason = f"the platform stands {distance:.2f} m, {turn:.2f} rad from its goal"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(posture, event, reason, goal=None if event else self._goal)

    def _place(self, scene: Scene) -> Array:
        """X_OB of the goal."""
        assert scene.box is not None
        box, pose = scene.box, scene.base.pose
        c, s = math.cos(pose[2]), math.sin(pose[2])
        if self._side == "back":
            back = self._distance - math.hypot(box.p[0], box.p[1])
            return np.array([pose[0] - back * c, pose[1] - back * s, pose[2]])
        if self._side == "towards":
            away = math.atan2(-box.p[1], -box.p[0])
        else:
            away = box.approach + math.pi
        x = float(box.p[0]) + self._distance * math.cos(away)
        y = float(box.p[1]) + self._distance * math.sin(away)
        heading = pose[2] + math.remainder(away + math.pi, math.tau)
        return np.array([pose[0] + c * x - s * y, pose[1] + s * x + c * y, heading])


TYPE = NodeType(
    "Drive_to_box",
    parameters=(
        Parameter("Distance", "m", 0.3, 5.0, doc="Of the box from the platform's middle."),
        Parameter(
            "Side",
            kind="word",
            default="front",
            choices=("front", "towards", "back"),
            doc="Of the box: its front, where the robot is, or straight back.",
        ),
        Parameter("Tolerance", "mm", 0.005, 0.5, 0.04, "Of the place; twice as many mrad."),
        TIMEOUT,
    ),
    events=(
        Event("Arrived", "The platform is there, and at rest."),
        Event("Blocked", "The platform has stood elsewhere for 4 s."),
        TIMEOUT_EVENT,
    ),
    doc="Have the platform drive to a place before the box.",
    make=DriveToBox,
)
