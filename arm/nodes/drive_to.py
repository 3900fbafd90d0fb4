"""Drive_to: have the platform go somewhere, and wait until it is there."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from arm.hds import Event, NodeType, Parameter, ParameterValue, Quantity
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock
from arm.nodes.conditions import ARRIVED, Conditions, State, Values, free
from arm.nodes.node import Context, Step

NEAR = 0.015
"""Arrived within this distance of the goal [m], ..."""
NEAR_HEADING = 0.03
"""... turned to it within this [rad], ..."""
STILL = 0.03
"""... no faster than this [m/s, rad/s] ..."""
STILL_TIME = 0.3
"""... for this long [s]."""
PROGRESS = 0.01
"""What must be left behind of the way [m, rad] ..."""
PATIENCE = 3.0
"""... within this time, or the platform is taken to be held up [s]."""


OFF_HEADING = 0.015
"""Most that the estimated heading is wrong in the goal region [rad]."""


def _arrived(state: State, values: Values) -> dict[str, float]:
    """Where the estimate says it is, to within what the estimate is wrong by."""
    x, y, heading = state.platform - [float(values[k]) for k in ("X", "Y", "Heading")]
    turn = abs(math.remainder(heading, 2.0 * math.pi))
    return {
        "platform near the goal": 1.0 - math.hypot(x, y) / (NEAR + ARRIVED),
        "platform turned to it": 1.0 - turn / (NEAR_HEADING + OFF_HEADING),
    }


class DriveTo:
    """Asks for a pose X_OB of the platform; the joints hold still and ride along.

    The goal goes out with arm/status and the base obeys it (``base/arm_goal.py``). Whether it got
    there is read off the observer's estimate, not asked of the base: nothing flows in a circle,
    and a base that refuses, is stopped or dies looks the same as one that is in the way of
    something. Its own status says which.

    Control law: none, the joints' rates are zero. Goal region: the platform within 15 mm and
    0.03 rad of the goal, no faster than 0.03 m/s for 0.3 s. Domain: the pen off the board, the way
    free for the platform and for the arm as it is held.
    """

    pressing = False
    conditions = Conditions(goal=_arrived, domain=free, good=("Arrived",))

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self.goal = np.array([float(values[k]) for k in ("X", "Y", "Heading")])
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, context: Context) -> None:
        """Ask from now on."""
        self._still = 0.0
        self._best = math.inf
        self._since = 0.0

    resume = enter

    def update(self, context: Context) -> Step:
        """Arrived at the goal, Blocked when the platform does not come nearer."""
        error = self.goal - context.base.pose
        distance = math.hypot(error[0], error[1])
        turn = abs(math.remainder(error[2], 2.0 * math.pi))
        slow = float(np.abs(context.base.velocity).max()) < STILL
        there = distance < NEAR and turn < NEAR_HEADING
        self._still = self._still + context.dt if there and slow else 0.0
        self._since += context.dt
        if distance + turn < self._best - PROGRESS or there:
            self._best, self._since = distance + turn, 0.0
        event, reason = None, ""
        if self._still >= STILL_TIME:
            event = "Arrived"
        elif self._since >= PATIENCE:
            event = "Blocked"
            reason = f"the platform came no nearer than {distance:.2f} m for {PATIENCE:g} s"
        elif self._clock.step(context.dt):
            event = "Timeout"
        goal = None if event else self.goal
        tip = context.tip
        measures = {TO_GO.name: distance}
        return Step(None, tip, np.zeros(3), event, reason=reason, goal=goal, measures=measures)


TO_GO = Quantity("To_go", "mm", "Of the platform to the goal, straight.")

TYPE = NodeType(
    "Drive_to",
    parameters=(
        Parameter("X", "m", -100.0, 100.0, doc="Of the platform, in the odometry frame."),
        Parameter("Y", "m", -100.0, 100.0, doc="To the left of where odometry began."),
        Parameter("Heading", "deg", -6.2832, 6.2832, 0.0, "Counter-clockwise."),
        TIMEOUT,
    ),
    events=(
        Event("Arrived", "The platform is at the goal, and at rest."),
        Event("Blocked", "The platform has come no nearer for 3 s: refused, stopped, held up."),
        TIMEOUT_EVENT,
    ),
    doc="Have the platform drive to a pose.",
    make=DriveTo,
    quantities=(TO_GO,),
)
