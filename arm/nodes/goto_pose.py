"""Goto_pose: bring the tip to a point over the board, pen square on it."""

from __future__ import annotations

import math

from arm.hds import NodeType
from arm.nodes.conditions import Conditions, State, Values, able, free
from arm.nodes.straight_way import (
    ENDING,
    EVENTS,
    TO_GO,
    StraightWay,
    at_point,
    coordinate,
    point_of,
)


def _clear_way(state: State, values: Values) -> dict[str, float]:
    """Off the board, or pressed on it with a way that leads off it more than along it."""
    off = free(state, values)["off the board"]
    x, y, out = point_of(state.tip, values) - state.tip
    leads_off = (out - math.hypot(x, y)) / 0.01
    return {**able(state, values), "off the board or leading off it": max(off, leads_off)}


class GotoPose(StraightWay):
    """A straight way in the board's frame S: x right, y up, z out of the board [m].

    Control law: orientation (pen square on the board) subject to position. Goal region: tip
    within 1 mm of the point. Domain: pen off the board, or the way leads off it more than along
    it; way and point within reach.
    """

    frame = "board"
    conditions = Conditions(goal=at_point("board"), domain=_clear_way)


TYPE = NodeType(
    "Goto_pose",
    parameters=(
        coordinate("X", -1.0, 1.0, "Right of the board's origin"),
        coordinate("Y", -1.0, 1.0, "Above the board's origin"),
        coordinate("Z", 0.005, 0.5, "In front of the board"),
        *ENDING,
    ),
    events=EVENTS,
    quantities=(TO_GO,),
    doc="Bring the tip to a point over the board.",
    make=GotoPose,
)
