"""Drive_to: drive to a pose in the way the platform can."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from arm.hds import Event, NodeType, ParameterValue, Quantity
from base.behaviour import Vote
from base.drive_to import DriveTo as Holonomic
from base.nodes.node import TIMEOUT, TIMEOUT_EVENT, Clock, Context, Step
from base.nodes.place import PLACE, STANDOFF, place_of
from base.nodes.speed import SPEED, TOLERANCE, TURN_TOLERANCE
from base.turn_drive_turn import TurnDriveTurn, range_and_bearing
from services.messages import Array


class DriveTo:
    """Run to completion: the paper's Phi_drive.

    Control law: turn, drive, turn on a platform that cannot move sideways; straight there, turning
    meanwhile, on one that can. Goal region: within ``Tolerance`` and ``Turn_tolerance``. Domain:
    anywhere with a free way; what is in the way is for other behaviours to see.
    """

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._values = values
        self._clock = Clock(float(values["Timeout"]))
        self._way: Holonomic | TurnDriveTurn | None = None
        self._place: Array = np.zeros(3)

    def enter(self, context: Context) -> None:
        """Fix the place; without ``Heading`` a platform that need not turn keeps its own."""
        place = self._place = place_of(self._values, context)
        approach = context.slower(float(self._values["Speed"]), math.inf)
        tolerance = float(self._values["Tolerance"]), float(self._values["Turn_tolerance"])
        if context.differential:
            self._way = TurnDriveTurn(place, approach, tolerance)
            return
        if not math.isfinite(place[2]):
            place[2] = context.pose[2]
        self._way = Holonomic(place, approach, tolerance)

    def update(self, context: Context) -> Step:
        """Arrived within the tolerances."""
        assert self._way is not None
        late = self._clock.step(context.dt)
        vote: Vote = self._way.vote(context.now, context.senses)
        measures = {"To_go": range_and_bearing(self._place, context.pose)[0]}
        if self._way.state == "arrived":
            return Step(vote, "Arrived", measures)
        return Step(vote, "Timeout" if late else None, measures)


TYPE = NodeType(
    "Drive_to",
    parameters=(
        *PLACE,
        STANDOFF,
        SPEED,
        TOLERANCE,
        TURN_TOLERANCE,
        TIMEOUT,
    ),
    events=(Event("Arrived", "The platform is there."), TIMEOUT_EVENT),
    quantities=(Quantity("To_go", "m", "Distance of the place."),),
    doc="Drive to a pose: straight, or by turn, drive and turn.",
    make=DriveTo,
)
