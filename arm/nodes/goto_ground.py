"""Goto_ground: bring the tip to a point of the ground frame, whatever the platform does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.hds import NodeType, Parameter, ParameterValue
from arm.nodes.conditions import Conditions, free
from arm.nodes.frames import Frame, pointing
from arm.nodes.node import Array, Context
from arm.nodes.straight_way import (
    ENDING,
    EVENTS,
    STAY,
    TO_GO,
    StraightWay,
    at_point,
    coordinate,
)


class GotoGround(StraightWay):
    """A straight way in the ground frame O: z up, x and y where odometry began [m].

    Control law: orientation subject to position. Goal region: tip within 1 mm of the point.
    Domain: pen off the board; way and point within reach from where the platform is, and from
    everywhere it goes meanwhile.
    """

    frame = "ground"
    conditions = Conditions(goal=at_point("ground"), domain=free)

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        super().__init__(values)
        self._heading = float(values["Heading"])
        self._elevation = float(values["Elevation"])

    def orientation(self, context: Context, frame: Frame) -> Array:
        """Along ``Heading`` and ``Elevation``; each stays as it is in F if not given."""
        z = frame.R.T @ context.kinematics.R[:, 2]
        if not (np.isfinite(self._heading) or np.isfinite(self._elevation)):
            return frame.R.T @ context.kinematics.R
        heading = self._heading if np.isfinite(self._heading) else np.arctan2(z[1], z[0])
        level = self._elevation
        elevation = level if np.isfinite(level) else np.arcsin(np.clip(z[2], -1.0, 1.0))
        return pointing(float(heading), float(elevation))


DIRECTION = (
    Parameter("Heading", "deg", -6.2832, 6.2832, STAY, "Of the pen, from x; stays if not given."),
    Parameter(
        "Elevation", "deg", -1.2218, 1.2218, STAY, "Of the pen above level; stays if not given."
    ),
)

TYPE = NodeType(
    "Goto_ground",
    parameters=(
        coordinate("X", -100.0, 100.0, "In the odometry frame"),
        coordinate("Y", -100.0, 100.0, "In the odometry frame"),
        coordinate("Z", 0.1, 2.5, "Above the floor"),
        *DIRECTION,
        *ENDING,
    ),
    events=EVENTS,
    quantities=(TO_GO,),
    doc="Bring the tip to a point of the ground frame.",
    make=GotoGround,
)
