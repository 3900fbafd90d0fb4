"""Whiteboard_circle: a full circle under pressure control."""

from __future__ import annotations

import math
from collections.abc import Mapping

from arm.hds import NodeType, Parameter, ParameterValue
from arm.nodes.conditions import Conditions, State, Values, near
from arm.nodes.stroke import DRAWN, EVENTS, PARAMETERS, Array, Stroke, direction, pressed, startable


def _closed(state: State, values: Values) -> dict[str, float]:
    return {**pressed(state, values), **near((state.tip - state.entered)[:2])}


class WhiteboardCircle(Stroke):
    """Counter-clockwise from where the pen is.

    Control law: orientation subject to position along the board subject to force into it, at
    ``Speed``. Goal region: back where it began. Domain: pen on the board; the circle within reach.
    """

    conditions = Conditions(goal=_closed, domain=startable)

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        super().__init__(values)
        self._radius = float(values["Radius"])
        self._angle = float(values["Start"])

    def length(self) -> float:
        """Of the circle [m]."""
        return 2.0 * math.pi * self._radius

    def point(self, s: float) -> tuple[Array, Array]:
        """On the circle at arc length ``s``."""
        angle = self._angle + s / self._radius
        offset = self._radius * (direction(angle) - direction(self._angle))
        return offset, direction(angle + math.pi / 2)


TYPE = NodeType(
    "Whiteboard_circle",
    parameters=(
        Parameter("Radius", unit="mm", lo=0.002, hi=0.5, doc="Of the circle."),
        Parameter(
            "Start",
            unit="deg",
            lo=-6.2832,
            hi=6.2832,
            default=0.0,
            doc="Where on the circle the pen starts, seen from its centre.",
        ),
        *PARAMETERS,
    ),
    events=EVENTS,
    quantities=(DRAWN,),
    doc="Draw a circle with pressure control.",
    make=WhiteboardCircle,
)
