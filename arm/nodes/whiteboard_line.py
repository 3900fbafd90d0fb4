"""Whiteboard_line: a straight stroke under pressure control."""

from __future__ import annotations

from collections.abc import Mapping

from arm.hds import NodeType, Parameter, ParameterValue
from arm.nodes.stroke import EVENTS, PARAMETERS, Array, Stroke, direction


class WhiteboardLine(Stroke):
    """From where the pen is, along a direction."""

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
    doc="Draw a line with pressure control.",
    make=WhiteboardLine,
)
