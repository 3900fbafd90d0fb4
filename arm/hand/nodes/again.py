"""Hand_again: back off, around the bottle, to another reach: back to where a grasp can start."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from arm.hand.grasp import line_of
from arm.hand.handling import Handling, Scene
from arm.hand.nodes.grasp import NOTHING
from arm.hand.nodes.node import Step
from arm.hand.ways import elsewhere
from arm.hds import Event, NodeType, Parameter, ParameterValue

Array = NDArray[np.float64]

SETTLE = 0.3
"""Time to come to rest at the end [s]."""


class HandAgain:
    """The refinement of ``arm/hand/grasp.py``: a reach near the axis is where grasps start from.

    Goal region: the end of a reach, as of ``Hand_reach``. Domain: wherever a try ended.
    """

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._most = int(values["Tries"])

    def enter(self, scene: Scene, hand: Handling) -> None:
        """Find a way, if another try is allowed."""
        hand.take(scene.at)
        hand.squeeze = 0.0
        self._path = None
        if len(hand.tries) < self._most:
            self._path = elsewhere(
                hand.model,
                hand.guess(scene.base),
                hand.plan,
                scene.at,
                line_of(hand.tries),
                hand.rng,
            )
        self._since = scene.t

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Reached; Missing where every try closed on nothing, Given_up where others failed."""
        if self._path is None:
            last = hand.tries[-1].end if hand.tries else ""
            missing = all(one.end == NOTHING for one in hand.tries)
            return Step("Missing" if missing else "Given_up", last)
        took = scene.t - self._since
        hand.reference, hand.rate = self._path.at(took)
        event = "Reached" if took > self._path.duration + SETTLE else None
        return Step(event, stand=True)


TYPE = NodeType(
    "Hand_again",
    parameters=(Parameter("Tries", "1", 1, 10, 3, "Reaches in all.", "integer"),),
    events=(
        Event("Reached", "The open hand is around the bottle once more."),
        Event("Missing", "Every try closed on nothing."),
        Event("Given_up", "So many tries have failed, or there is no way."),
    ),
    doc="Open, back off and reach once more, from near the bottle's axis.",
    make=HandAgain,
)
