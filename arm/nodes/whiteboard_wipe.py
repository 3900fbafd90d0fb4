"""Whiteboard_wipe: back and forth over a rectangle, under pressure control."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from arm.hds import NodeType, Parameter, ParameterValue
from arm.nodes.curve import Curve
from arm.nodes.curve_stroke import ACCELERATION, CurveStroke
from arm.nodes.stroke import DRAWN, EVENTS, PARAMETERS, Array


class WhiteboardWipe(CurveStroke):
    """Rows to the right and to the left, with round turns, from the upper left corner down.

    Control law: as every stroke. Goal region: the end of the last row. Domain: pen on the board in
    the rectangle's upper left corner; all of the rectangle within reach.
    """

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        rows = wipe_rows(*(float(values[k]) for k in ("Width", "Height", "Spacing")))
        super().__init__(values, Curve(rows))


def wipe_rows(width: float, height: float, spacing: float) -> Array:
    """Vertices of the way over a rectangle [m], from (0, 0) right and down, shape (n, 2).

    The rows are as far apart as ``spacing`` or a little nearer, so that the last one is on the
    lower edge; half circles of that diameter join them, within the rectangle.

    Raises:
        ValueError: the rectangle is narrower than a turn.
    """
    count = max(math.ceil(height / spacing - 1e-9), 1)
    radius = 0.5 * height / count
    if width <= 2.0 * radius:
        raise ValueError("Width must be more than the distance of the rows")
    turn = np.linspace(math.pi / 2, -math.pi / 2, 33)
    vertices = [np.array([[0.0, 0.0]])]
    for row in range(count):
        middle = -(2 * row + 1) * radius
        x, y = radius * np.cos(turn), middle + radius * np.sin(turn)
        right = row % 2 == 0
        x = width - radius + x if right else radius - x
        vertices.append(np.column_stack([x, y]))
    last = width if count % 2 == 0 else 0.0
    vertices.append(np.array([[last, -height]]))
    return np.concatenate(vertices)


TYPE = NodeType(
    "Whiteboard_wipe",
    parameters=(
        Parameter("Width", "mm", 0.01, 2.0, doc="Of the rectangle, to the right of the pen."),
        Parameter("Height", "mm", 0.005, 2.0, doc="Of the rectangle, below the pen."),
        Parameter("Spacing", "mm", 0.002, 0.2, 0.01, "Of the rows, at most."),
        ACCELERATION,
        *PARAMETERS,
    ),
    events=EVENTS,
    quantities=(DRAWN,),
    doc="Wipe over a rectangle, back and forth, with pressure control.",
    make=WhiteboardWipe,
)
