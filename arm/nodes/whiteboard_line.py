"""Whiteboard_line: a straight stroke under pressure control."""

from __future__ import annotations

from collections.abc import Mapping

from arm.hds import NodeType, Parameter, ParameterValue
from arm.nodes.conditions import Conditions, State, Values, near
from arm.nodes.stroke import (
    DRAWN,
    EVENTS,
    PARAMETERS,
    Array,
    Stroke,
    direction,
    pressed,
    startable,
)


def _drawn(state: State, values: Values) -> dict[str, float]:
    line = float(values["Length"]) * direction(float(values["Direction"]))
    return {**pressed(state, values), **near((state.tip - state.entered)[:2] - line)}


class WhiteboardLine(Stroke):
    """From where the pen is, along a direction.

    Control law: orientation subject to position along the board subject to force into it, at
    ``Speed``. Goal region: the end of the line. Domain: pen on the board; the line within reach.
    """

    conditions = Conditions(goal=_drawn, domain=startable)

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        super().__init__(values)
        self._length = float(values["Length"])
        self._direction = direction(float(values["Direction"]))

    def length(self) -> float:
        """Of the line [m]."""
        return self._length

    def point(self, s: float) -> tuple[Array, Array]:
        """On the line at arc length ``s``."""
        return s * self._direction, self._direction


TYPE = NodeType(
    "Whiteboard_line",
    parameters=(
        Parameter("Length", unit="mm", lo=0.001, hi=2.0, doc="Of the line."),
        Parameter(
            "Direction",
            unit="deg",
            lo=-6.2832,
            hi=6.2832,
            doc="From right, counter-clockwise, as the drawer sees the board.",
        ),
        *PARAMETERS,
    ),
    events=EVENTS,
    quantities=(DRAWN,),
    doc="Draw a line with pressure control.",
    make=WhiteboardLine,
)
