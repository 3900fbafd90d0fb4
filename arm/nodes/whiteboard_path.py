"""Whiteboard_path: draw the curves of an SVG file, lifting the pen between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT_EVENT, Clock
from arm.nodes.conditions import Conditions, free
from arm.nodes.curve import Curve, CurveLaw
from arm.nodes.curve_stroke import ACCELERATION, CurveStroke
from arm.nodes.goto_pose import GotoPose
from arm.nodes.node import Array, Context, Control, Step
from arm.nodes.straight_way import STAY
from arm.nodes.stroke import DRAWN, PARAMETERS
from arm.nodes.svg_file import read_strokes
from arm.nodes.whiteboard_approach import WhiteboardApproach

FIRST = 0.015
"""Height over the believed board from which it is first touched [m]."""
TOUCH = 0.5
"""Share of the drawing force that means contact."""
TOUCH_SPEED = 0.02
"""[m/s]"""
DEPTH = 0.03
"""The board is looked for this far beyond where it should be [m]."""
STRETCHED = 0.003
"""Reach left at which drawing is given up, before the arm's limit stops everything [m]."""


@dataclass(frozen=True)
class Piece:
    """One curve of a drawing, and how it is run through."""

    curve: Curve
    law: CurveLaw


@lru_cache(maxsize=64)
def read_drawing(
    file: Path, stamp: int, width: float, centre: tuple[float, float], speed: float, most: float
) -> tuple[Piece, ...]:
    """The pieces of a file, with speed [m/s] and acceleration [m/s^2] at most; see read_strokes."""
    curves = [Curve(points) for points in read_strokes(file, width, centre)]
    return tuple(Piece(curve, CurveLaw(curve, speed, most)) for curve in curves)


class WhiteboardPath:
    """Curve after curve in the order of the file: over its start, onto the board, along it, off.

    Control law: as ``Goto_pose``, ``Whiteboard_approach`` and the strokes, in turn. Goal region:
    every curve drawn, the tip ``Clearance`` off the board. Domain: pen off the board; every point
    within reach with ``Margin`` to spare, which is checked when the program is started.

    Raises:
        ValueError: the file cannot be drawn.
    """

    conditions = Conditions(goal=free, domain=free)

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        file = Path(str(values["File"]))
        self._pieces = read_drawing(
            file,
            file.stat().st_mtime_ns,
            float(values["Width"]),
            (float(values["X"]), float(values["Y"])),
            float(values["Speed"]),
            float(values["Acceleration"]),
        )
        self._values = dict(values)
        self._clearance = float(values["Clearance"])
        self.margin = float(values["Margin"])
        self._clock = Clock(float(values["Timeout"]))
        self._piece = 0
        self._phase = 0
        self._surface: float | None = None
        self._before = 0.0
        self._now: Control | None = None

    @property
    def length(self) -> float:
        """Of all curves [m]."""
        return sum(piece.curve.length for piece in self._pieces)

    @property
    def pressing(self) -> bool:
        """The pen is meant to be on the board."""
        return self._now is not None and self._now.pressing

    def points(self) -> Array:
        """Every point that is to be reached, p_ST_S, shape (n, 3) [m]."""
        flat = np.concatenate([piece.curve.points for piece in self._pieces])
        return np.column_stack([flat, np.zeros(len(flat))])

    def enter(self, context: Context) -> None:
        """Begin with the first curve."""
        self._begin(context)

    def resume(self, context: Context) -> None:
        """Go on with what was interrupted."""
        assert self._now is not None
        self._now.resume(context)

    def update(self, context: Context) -> Step:
        """Finished when all is drawn."""
        assert self._now is not None
        step = self._now.update(context)
        while step.event is not None and step.event != "Out_of_Reach":
            context.desired = step.desired
            if self._phase == 2:
                self._before += self._pieces[self._piece].curve.length
                self._surface = float(step.desired[2])
            self._phase += 1
            if self._phase == 4:
                if self._piece == len(self._pieces) - 1:
                    break
                self._piece, self._phase = self._piece + 1, 0
            self._begin(context)
            step = self._now.update(context)
        step.part = 4 * self._piece + self._phase
        now = step.measures[DRAWN.name] if self._phase == 2 else 0.0
        step.measures = {DRAWN.name: self._before + now}
        if step.event == "Out_of_Reach":
            step.reason = f"no board felt for curve {self._piece + 1} of {len(self._pieces)}"
        elif step.event is None and self.pressing and context.reach_margin < STRETCHED:
            step.event = "Out_of_Reach"
            step.reason = f"stretched out in curve {self._piece + 1} of {len(self._pieces)}"
        elif self._clock.step(context.dt) and step.event is None:
            step.event = "Timeout"
        return step

    def _begin(self, context: Context) -> None:
        """Start the phase: 0 to the curve's start, 1 onto the board, 2 along, 3 off it."""
        curve = self._pieces[self._piece].curve
        forever = {"Timeout": STAY}
        if self._phase == 0:
            height = FIRST if self._surface is None else self._surface + self._clearance
            x, y = (float(v) for v in curve.points[0])
            way = {"X": x, "Y": y, "Z": height, "Speed": self._values["Travel"]}
            self._now = GotoPose(way | forever)
        elif self._phase == 1:
            touch = {
                "Force": TOUCH * float(self._values["Force"]),
                "Filter": self._values["Filter"],
                "Speed": TOUCH_SPEED,
                "Distance": float(context.desired[2]) + DEPTH,
                "MaxX": STAY,
            }
            self._now = _Touch(touch | forever)
        elif self._phase == 2:
            values = self._values | forever
            self._now = CurveStroke(values, curve, self._pieces[self._piece].law)
        else:
            height = float(context.desired[2]) + self._clearance
            way = {"X": STAY, "Y": STAY, "Z": height, "Speed": self._values["Travel"]}
            self._now = GotoPose(way | forever)
        self._now.enter(context)


class _Touch(WhiteboardApproach):
    """Gives up behind where the board should be."""

    def given_up(self, context: Context) -> str | None:
        gone = self._gone >= self._distance
        return "Out_of_Reach" if gone else super().given_up(context)


TYPE = NodeType(
    "Whiteboard_path",
    parameters=(
        Parameter("File", kind="word", doc="SVG file, beside the program file or in arm/programs."),
        Parameter("Width", "mm", 0.005, 2.0, doc="Of the drawing on the board."),
        Parameter("X", "mm", -1.0, 1.0, 0.0, "Middle of the drawing, right of the board's origin."),
        Parameter("Y", "mm", -1.0, 1.0, 0.0, "Middle of the drawing, above the board's origin."),
        ACCELERATION,
        Parameter("Clearance", "mm", 0.003, 0.1, 0.01, "Of the pen between curves."),
        Parameter("Travel", "mm/s", 0.001, 0.5, 0.15, "Speed between curves."),
        Parameter("Margin", "mm", 0.0, 0.5, 0.02, "Reach that must be left at every point."),
        *PARAMETERS,
    ),
    events=(
        Event("Finished", "All is drawn, the pen is off the board."),
        Event("Out_of_Reach", "No board is felt, or the arm is stretched out."),
        TIMEOUT_EVENT,
    ),
    doc="Draw the curves of an SVG file.",
    make=WhiteboardPath,
    quantities=(DRAWN,),
)
