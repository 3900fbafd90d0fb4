"""Whiteboard_approach: move along the board's normal until the pen touches it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.control import LowPass, Orientation, Position
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.nodes.filters import FILTER, filter_cutoff
from arm.nodes.node import TIMEOUT, TIMEOUT_EVENT, TOOL_ON_BOARD, Clock, Context, Step

RAMP = 0.2
"""Time to reach the approach speed [s]."""
TICKS = 4
"""Consecutive ticks above the threshold that make a contact."""


class WhiteboardApproach:
    """A guarded move."""

    pressing = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._threshold = float(values["Force"])
        self._filter = LowPass(filter_cutoff(int(values["Filter"])))
        self._max_x = float(values["MaxX"])
        self._speed = float(values["Speed"])
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, context: Context) -> None:
        """Approach straight from what was asked for last."""
        self._desired = context.desired.copy()
        self._now = 0.0
        self._above = 0
        self._position = Position(np.eye(3))
        self._orientation = Orientation(context.R_OS @ TOOL_ON_BOARD)

    resume = enter

    def update(self, context: Context) -> Step:
        """Contact above ``Force``; Out_of_Reach when the tip is beyond ``MaxX`` ahead of B."""
        force = self._filter.step(context.force, context.dt)
        self._above = self._above + 1 if force > self._threshold else 0
        self._now = min(self._now + context.dt / RAMP, 1.0)
        speed = self._speed * self._now**2 * (3.0 - 2.0 * self._now)
        velocity = np.array([0.0, 0.0, -speed])
        self._desired = self._desired + velocity * context.dt
        self._position.track(context.p_OS + context.R_OS @ self._desired, context.R_OS @ velocity)
        ahead = context.in_platform(context.kinematics.p)[0]
        event = None
        if self._above >= TICKS:
            event = "Contact"
        elif ahead > self._max_x or context.reach_margin <= 0.0:
            event = "Out_of_Reach"
        elif self._clock.step(context.dt):
            event = "Timeout"
        return Step(
            self._orientation.subject_to(self._position),
            self._desired,
            velocity,
            event,
            filtered=force,
        )


TYPE = NodeType(
    "Whiteboard_approach",
    parameters=(
        Parameter("Force", unit="cN", lo=0.2, hi=20.0, doc="Filtered force that means contact."),
        FILTER,
        Parameter(
            "MaxX",
            unit="mm",
            lo=0.1,
            hi=2.0,
            default=1.0,
            doc="Out of reach beyond this distance ahead of the platform's centre.",
        ),
        Parameter("Speed", unit="mm/s", lo=0.001, hi=0.1, default=0.02, doc="Towards the board."),
        TIMEOUT,
    ),
    events=(
        Event("Contact", "The pen touches the board."),
        Event("Out_of_Reach", "No contact before MaxX, or the arm is stretched out."),
        TIMEOUT_EVENT,
    ),
    doc="Approach the board and detect contact.",
    make=WhiteboardApproach,
)
