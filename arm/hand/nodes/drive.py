"""Hand_drive: have the platform go before the bottle, joints as they are."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from arm.hand.handling import Handling, Scene
from arm.hand.nodes.node import Step
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock
from arm.model import Base

Array = NDArray[np.float64]

STILL, STILL_TIME = 0.02, 0.3
"""Arrived no faster than this [m/s, rad/s], for this long [s]."""

DISTANCE = Parameter("Distance", "m", 0.3, 1.0, 0.5, "Of the bottle from the platform's middle.")
TOLERANCE = Parameter("Tolerance", "mm", 0.005, 0.2, 0.02, "Of the place; twice as many mrad.")


def before(x: float, y: float, facing: float, distance: float) -> Array:
    """X_OB of a platform that has x, y [m] straight ahead at a distance, heading ``facing``."""
    return np.array([x - distance * math.cos(facing), y - distance * math.sin(facing), facing])


class Arrival:
    """Says when the platform stands at a goal.

    Args:
        goal: X_OB, shape (3,).
        tolerance: of the place [m]; twice as much of the heading [rad].
    """

    def __init__(self, goal: Array, tolerance: float) -> None:
        self.goal, self._tolerance = goal, tolerance
        self._still = 0.0

    def step(self, dt: float, base: Base) -> bool:
        """Whether it has stood there for a while."""
        error = self.goal - base.pose
        there = math.hypot(error[0], error[1]) < self._tolerance
        there = there and abs(math.remainder(error[2], math.tau)) < 2.0 * self._tolerance
        slow = float(np.abs(base.velocity).max()) < STILL
        self._still = self._still + dt if there and slow else 0.0
        return self._still >= STILL_TIME


class HandDrive:
    """The platform's own ``drive_to``; goal region: at rest within ``Tolerance``."""

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._distance = float(values["Distance"])
        self._tolerance = float(values["Tolerance"])
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, scene: Scene, hand: Handling) -> None:
        """Fix the goal."""
        task = hand.task
        goal = before(task.x, task.y, task.facing, self._distance)
        self._arrival = Arrival(goal, self._tolerance)

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Arrived, or Timeout."""
        event = None
        if self._arrival.step(scene.dt, scene.base):
            event = "Arrived"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(event, goal=None if event else self._arrival.goal)


TYPE = NodeType(
    "Hand_drive",
    parameters=(DISTANCE, TOLERANCE, TIMEOUT),
    events=(Event("Arrived", "The platform stands there."), TIMEOUT_EVENT),
    doc="Have the platform drive before the bottle, joints still.",
    make=HandDrive,
)
