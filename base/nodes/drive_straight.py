"""Drive_straight: drive ahead to a place that lies ahead."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from arm.hds import Event, NodeType, ParameterValue, Quantity
from base.behaviour import Vote
from base.nodes.node import TIMEOUT, TIMEOUT_EVENT, Clock, Context, Step
from base.nodes.place import OF, STANDOFF, X, Y, place_of
from base.nodes.speed import SPEED, TOLERANCE
from base.turn_drive_turn import OFF_COURSE, PASSED, driving, range_and_bearing
from services.messages import Array


class DriveStraight:
    """Ahead, steered towards the place, never sideways and never back.

    Control law: speed from what is left ahead, yaw rate from the bearing. Goal region: within
    ``Tolerance`` of the place. Domain: the place within 0.5 rad of straight ahead; another
    behaviour may push the platform out of it, and a place may be passed: both raise Off_course.
    """

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._values = {**values, "Heading": math.inf}
        self._tolerance = float(values["Tolerance"])
        self._clock = Clock(float(values["Timeout"]))
        self._place: Array = np.zeros(3)

    def enter(self, context: Context) -> None:
        """Fix the place."""
        self._place = place_of(self._values, context)

    def update(self, context: Context) -> Step:
        """Arrived where no more is left ahead, if that is near enough."""
        late = self._clock.step(context.dt)
        distance, bearing = range_and_bearing(self._place, context.pose)
        measures = {"To_go": distance}
        near = distance <= self._tolerance
        if near and distance * math.cos(bearing) <= PASSED * self._tolerance:
            return Step(Vote(np.zeros(3)), "Arrived", measures)
        if not near and abs(bearing) > OFF_COURSE:
            return Step(Vote(np.zeros(3)), "Off_course", measures)
        approach = context.slower(float(self._values["Speed"]), math.inf)
        vote = Vote(driving(approach, distance, bearing))
        return Step(vote, "Timeout" if late else None, measures)


TYPE = NodeType(
    "Drive_straight",
    parameters=(OF, X, Y, STANDOFF, SPEED, TOLERANCE, TIMEOUT),
    events=(
        Event("Arrived", "The platform is at the place."),
        Event("Off_course", "The place does not lie ahead: turn first."),
        TIMEOUT_EVENT,
    ),
    quantities=(Quantity("To_go", "m", "Distance of the place."),),
    doc="Drive ahead to a place that lies ahead.",
    make=DriveStraight,
)
