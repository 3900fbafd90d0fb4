"""Retract: take the tip straight away from the board."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.hds import NodeType, Parameter, ParameterValue
from arm.nodes.conditions import Conditions, State, Values, able, near
from arm.nodes.node import Array
from arm.nodes.straight_way import ENDING, EVENTS, STAY, TO_GO, StraightWay


def _off(state: State, values: Values) -> dict[str, float]:
    out = np.array([0.0, 0.0, float(values["Distance"])])
    return near(state.tip - state.entered - out)


class Retract(StraightWay):
    """A straight way along the board's normal, from wherever the tip is, touching or not.

    Control law: orientation (pen square on the board) subject to position. Goal region: tip
    within 1 mm of the point ``Distance`` out of where it was. Domain: that point within reach.
    """

    conditions = Conditions(goal=_off, domain=able)

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        super().__init__({"X": STAY, "Y": STAY, "Z": STAY, **values})
        self._distance = float(values["Distance"])
        self._end: Array | None = None

    def target(self, now: Array) -> Array:
        """Out of the board; after an interruption the point that was meant at first."""
        if self._end is None:
            self._end = now + np.array([0.0, 0.0, self._distance])
        return self._end


TYPE = NodeType(
    "Retract",
    parameters=(
        Parameter("Distance", "mm", 0.001, 0.5, 0.03, "Out of the board, from where the tip is."),
        *ENDING,
    ),
    events=EVENTS,
    quantities=(TO_GO,),
    doc="Take the tip straight away from the board.",
    make=Retract,
)
