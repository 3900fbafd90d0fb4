"""Hand_lower: straight down until the table takes the weight."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.hand.handling import Handling, Scene
from arm.hand.nodes.node import Step
from arm.hds import Event, NodeType, Parameter, ParameterValue

SLOW = 0.015
"""The last stretch before the table is expected [m]."""
SHARE = 0.5
"""Share of the load that is left when it is down."""
BEYOND = 0.02
"""The table is felt no later than this below where it is expected [m]."""


class HandLower:
    """Down by what it was lifted; the load on the fingertips tells the table.

    Goal region: the load is less than half. Domain: the hand above a table, as high as after the
    lift.
    """

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._speed, self._touch = float(values["Speed"]), float(values["Touch_speed"])

    def enter(self, scene: Scene, hand: Handling) -> None:
        """Weigh what is held."""
        hand.carrier.capture(hand.reference, scene.base)
        self._top = float(hand.carrier.p[2])
        self._load, self._now, self._light = hand.load, 0.0, 0.0

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Down, or No_table."""
        height = hand.carrier.p[2] - hand.stood
        limit = self._touch if height < SLOW else self._speed
        limit = min(limit, (2.0 * 0.4 * max(height - SLOW, 0.0) + self._touch**2) ** 0.5)
        self._now = min(self._now + 0.4 * scene.dt, limit)
        hand.go(scene, np.array([0.0, 0.0, -self._now]))
        light = height < SLOW and hand.load < SHARE * self._load
        self._light = self._light + scene.dt if light else 0.0
        if self._light > 0.03:
            return Step("Down", stand=True)
        if height < -BEYOND:
            return Step("No_table", "there is no table under the bottle")
        return Step(stand=True)


TYPE = NodeType(
    "Hand_lower",
    parameters=(
        Parameter("Speed", "mm/s", 0.005, 0.3, 0.1, "On the way."),
        Parameter("Touch_speed", "mm/s", 0.001, 0.05, 0.008, "Where the table is expected."),
    ),
    events=(
        Event("Down", "The table carries it."),
        Event("No_table", "There is none where it was expected."),
    ),
    doc="Lower what is held until the table takes its weight.",
    make=HandLower,
)
