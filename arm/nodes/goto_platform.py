"""Goto_platform: bring the tip to a point of the platform's frame, which it then moves with."""

from __future__ import annotations

from arm.hds import NodeType
from arm.nodes.conditions import Conditions, free
from arm.nodes.goto_ground import DIRECTION, GotoGround
from arm.nodes.straight_way import ENDING, EVENTS, TO_GO, at_point, coordinate


class GotoPlatform(GotoGround):
    """A straight way in the platform's frame B: x ahead, y left, z up from the floor [m].

    Control law: orientation subject to position, both moving with the platform. Goal region: tip
    within 1 mm of the point. Domain: pen off the board and the platform not driving the arm into
    it; way and point within reach, which no motion of the platform changes.
    """

    frame = "platform"
    conditions = Conditions(goal=at_point("platform"), domain=free)


TYPE = NodeType(
    "Goto_platform",
    parameters=(
        coordinate("X", -1.2, 1.2, "Ahead of the platform's centre"),
        coordinate("Y", -1.2, 1.2, "Left of the platform's centre"),
        coordinate("Z", 0.5, 2.5, "Above the floor"),
        *DIRECTION,
        *ENDING,
    ),
    events=EVENTS,
    quantities=(TO_GO,),
    doc="Bring the tip to a point of the platform's frame.",
    make=GotoPlatform,
)
