"""Hand_stay: the hand still in the world while the platform goes to and fro under it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.hand.handling import Handling, Scene
from arm.hand.moving import turned
from arm.hand.nodes.node import Step
from arm.hds import Event, NodeType, Parameter, ParameterValue

WAY = ((0.0, 1.0, 1.0), (-0.6, -1.0, -1.0), (0.3, 0.8, -0.8), (-0.3, -0.8, 0.8))
"""Where the platform is asked to go in turn: along x, y [Move], and turned [Turn]."""


class HandStay:
    """Shows, and lets be measured, how well the arm makes up for the platform.

    ``Frame = platform`` leaves the observer's estimate out: the hand goes where the platform goes.
    Goal region: ``Time`` is over. Domain: the bottle lifted, the hand in the middle of its reach.
    """

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._time, self._every = float(values["Time"]), float(values["Every"])
        self._move, self._turn = float(values["Move"]), float(values["Turn"])
        self._compensate = values["Frame"] == "ground"

    def enter(self, scene: Scene, hand: Handling) -> None:
        """From where the references are."""
        hand.carrier.capture(hand.reference, scene.base, self._compensate)
        self._pose, self._R = scene.base.pose.copy(), turned(scene.base)
        self._took = 0.0

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Stayed when the time is over."""
        self._took += scene.dt
        hand.go(scene, np.zeros(3))
        left = self._time - self._took
        if left <= 0.0:
            return Step("Stayed")
        if self._move <= 0.0 and self._turn <= 0.0:
            return Step()
        x, y, turn = WAY[int(self._took / self._every) % len(WAY)]
        # the last goal leads back to the middle
        share = 0.0 if left < self._every else 1.0
        off = share * (self._R @ [x * self._move, y * self._move, 0.0])
        goal = self._pose + [off[0], off[1], share * turn * self._turn]
        return Step(goal=goal)


TYPE = NodeType(
    "Hand_stay",
    parameters=(
        Parameter("Time", "s", 0.1, 3600, 8.0, "How long."),
        Parameter("Move", "mm", 0.0, 0.25, 0.12, "How far the platform goes to each side."),
        Parameter("Turn", "deg", 0.0, 0.3, 0.07, "How far it turns."),
        Parameter("Every", "s", 0.3, 60, 1.3, "When it is asked to go to the next place."),
        Parameter(
            "Frame",
            kind="word",
            default="ground",
            choices=("ground", "platform"),
            doc="Where the hand is still; on the platform, nothing is made up for.",
        ),
    ),
    events=(Event("Stayed", "Time is over."),),
    doc="Keep the hand still in the world while the platform goes to and fro.",
    make=HandStay,
)
