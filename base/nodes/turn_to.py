"""Turn_to: turn on the spot, to a heading or towards a place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from arm.hds import Event, NodeType, Parameter, ParameterValue, Quantity
from base.behaviour import Vote
from base.nodes.node import TIMEOUT, TIMEOUT_EVENT, Clock, Context, Step
from base.nodes.place import PLACE, place_of
from base.nodes.speed import TURN_TOLERANCE
from base.planar import wrap
from base.turn_drive_turn import range_and_bearing, turning
from services.messages import Array

SLOW = 0.05
"""The platform has turned when it turns no faster than this [rad/s]."""


class TurnTo:
    """To ``Heading`` if it is given, else until the place lies straight ahead.

    Control law: proportional to the angle left near the end, a braking curve before. Goal region:
    the angle within ``Tolerance``, turning no faster than 0.05 rad/s. Domain: anywhere; towards a
    place, not on top of it, where it lies nowhere.
    """

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._values = values
        self._clock = Clock(float(values["Timeout"]))
        self._place: Array = np.zeros(3)

    def enter(self, context: Context) -> None:
        """Fix the place."""
        self._place = place_of(self._values, context)

    def update(self, context: Context) -> Step:
        """Arrived once the angle is small and the platform turns no more."""
        late = self._clock.step(context.dt)
        angle = self._left(context.pose)
        measures = {"To_turn": abs(angle)}
        still = abs(context.senses.estimate.velocity[2]) <= SLOW
        if abs(angle) <= float(self._values["Tolerance"]) and still:
            return Step(Vote(np.zeros(3)), "Arrived", measures)
        approach = context.slower(math.inf, float(self._values["Turn"]))
        return Step(Vote(turning(approach, angle)), "Timeout" if late else None, measures)

    def _left(self, pose: Array) -> float:
        if math.isfinite(self._place[2]):
            return wrap(float(self._place[2] - pose[2]))
        return range_and_bearing(self._place, pose)[1]


TYPE = NodeType(
    "Turn_to",
    parameters=(
        *PLACE,
        Parameter("Turn", "deg/s", lo=0.01, hi=10.0, default=math.inf, doc="At most."),
        replace(TURN_TOLERANCE, name="Tolerance", doc="Of the angle."),
        TIMEOUT,
    ),
    events=(Event("Arrived", "The platform has turned."), TIMEOUT_EVENT),
    quantities=(Quantity("To_turn", "deg", "Angle left, without sign."),),
    doc="Turn on the spot, to a heading or towards a place.",
    make=TurnTo,
)
