"""Hold: keep the tip where it is over the board, so that the arm comes to rest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.control import Orientation, Position
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import Clock
from arm.nodes.conditions import Conditions, free, stayed
from arm.nodes.node import TOOL_ON_BOARD, Context, Step


class Hold:
    """Position and orientation kept in the board's frame, whatever the platform does.

    Control law: orientation (pen square on the board) subject to position, both standing still in
    S. Goal region: ``Time`` has passed. Domain: the point within reach for as long as that.
    """

    pressing = False
    conditions = Conditions(goal=stayed, domain=free, good=("Timeout",))

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._clock = Clock(float(values["Time"]))

    def enter(self, context: Context) -> None:
        """Hold what was asked for last."""
        self._desired = context.desired.copy()
        self._position = Position(np.eye(3))
        self._orientation = Orientation(context.R_OS @ TOOL_ON_BOARD)

    resume = enter

    def update(self, context: Context) -> Step:
        """Timeout after ``Time``."""
        over = self._clock.step(context.dt)
        self._position.track(context.p_OS + context.R_OS @ self._desired, np.zeros(3))
        return Step(
            self._orientation.subject_to(self._position),
            self._desired,
            np.zeros(3),
            "Timeout" if over else None,
        )


TYPE = NodeType(
    "Hold",
    parameters=(
        Parameter("Time", unit="s", lo=0.0, hi=3600, default=float("inf"), doc="How long."),
    ),
    events=(Event("Timeout", "Time is over.", needs="Time"),),
    doc="Keep the tip still over the board.",
    make=Hold,
)
