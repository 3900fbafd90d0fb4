"""Where a node is to go: a place in a frame, or short of it on the way there."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from arm.hds import Parameter, ParameterValue
from base.nodes.node import Context
from base.planar import compose
from base.turn_drive_turn import range_and_bearing
from services.messages import Array

FRAMES = ("ground", "start", "goal", "object")
"""Frames of a place: O; the platform's at the program's start; the task's goal and object."""
GIVEN = ("goal", "object")
"""Those of them that the task gives."""

OF = Parameter(
    "Of", kind="word", choices=FRAMES, default="ground", doc="Frame of X, Y and Heading."
)
X = Parameter("X", "m", lo=-100, hi=100, default=0.0, doc="Of the place, ahead in the frame.")
Y = Parameter("Y", "m", lo=-100, hi=100, default=0.0, doc="And to the left.")
HEADING = Parameter(
    "Heading",
    "deg",
    lo=-2 * math.pi,
    hi=2 * math.pi,
    default=math.inf,
    doc="There, counter-clockwise; without, any.",
)
STANDOFF = Parameter(
    "Standoff",
    "m",
    lo=0.0,
    hi=100.0,
    default=0.0,
    doc="Stay this far short of the place, on the line from where the node is entered.",
)
PLACE = (OF, X, Y, HEADING)


def place_of(values: Mapping[str, ParameterValue], context: Context) -> Array:
    """(3,) X_OB that a node's parameters ask for [m, m, rad]; heading NaN where none is asked."""
    heading = float(values["Heading"])
    inner = np.array(
        [float(values["X"]), float(values["Y"]), heading if math.isfinite(heading) else math.nan]
    )
    there = compose(context.frames[str(values["Of"])], inner)
    short = float(values.get("Standoff", 0.0))
    if short > 0.0:
        distance, _ = range_and_bearing(there, context.pose)
        share = max(0.0, 1.0 - short / distance) if distance > 0.0 else 0.0
        there[:2] = context.pose[:2] + share * (there[:2] - context.pose[:2])
    return there
