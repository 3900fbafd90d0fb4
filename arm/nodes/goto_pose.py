"""Goto_pose: bring the tip to a point over the board, pen square on it."""

from __future__ import annotations

from arm.hds import NodeType
from arm.nodes.straight_way import ENDING, EVENTS, TO_GO, StraightWay, coordinate


class GotoPose(StraightWay):
    """A straight way in the board's frame S: x right, y up, z out of the board [m].

    Control law: orientation (pen square on the board) subject to position. Goal region: tip
    within 1 mm of the point. Domain: pen off the board, way and point within reach.
    """

    frame = "board"


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
