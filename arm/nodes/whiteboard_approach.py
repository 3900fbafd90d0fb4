"""Whiteboard_approach: move along the board's normal until the pen touches it."""

from __future__ import annotations

from collections.abc import Mapping

from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT
from arm.nodes.conditions import Conditions, State, Values, free
from arm.nodes.filters import FILTER
from arm.nodes.guarded_move import GONE, SPEED, THRESHOLD, GuardedMove, felt
from arm.nodes.node import TOOL_ON_BOARD, Array, Context


def _in_front(state: State, values: Values) -> dict[str, float]:
    return {**free(state, values), "in front of the board": state.clearance / 0.005}


class WhiteboardApproach(GuardedMove):
    """A guarded move into the board, pen square on it.

    Control law: orientation subject to position along -z_S at ``Speed``. Goal region: filtered
    force on the board above ``Force`` for 4 ticks. Domain: pen in front of the board, not
    touching; the board nearer than ``MaxX`` ahead of the platform's centre, and within reach.
    """

    conditions = Conditions(goal=felt, domain=_in_front, good=("Contact",))

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        into: dict[str, ParameterValue] = {
            "Frame": "board",
            "DX": 0.0,
            "DY": 0.0,
            "DZ": -1.0,
            "Distance": float("inf"),
        }
        super().__init__({**into, **values})
        self._max_x = float(values["MaxX"])

    def orientation(self, context: Context) -> Array:
        """Square on the board."""
        return context.R_OS @ TOOL_ON_BOARD

    def given_up(self, context: Context) -> str | None:
        """Out_of_Reach when the tip is beyond ``MaxX`` ahead of B, or the arm stretched out."""
        ahead = context.in_platform(context.kinematics.p)[0]
        return "Out_of_Reach" if ahead > self._max_x or context.reach_margin <= 0.0 else None


TYPE = NodeType(
    "Whiteboard_approach",
    parameters=(
        THRESHOLD,
        FILTER,
        Parameter(
            "MaxX",
            unit="mm",
            lo=0.1,
            hi=2.0,
            default=1.0,
            doc="Out of reach beyond this distance ahead of the platform's centre.",
        ),
        SPEED,
        TIMEOUT,
    ),
    events=(
        Event("Contact", "The pen touches the board."),
        Event("Out_of_Reach", "No contact before MaxX, or the arm is stretched out."),
        TIMEOUT_EVENT,
    ),
    doc="Approach the board and detect contact.",
    make=WhiteboardApproach,
    quantities=(GONE,),
)
