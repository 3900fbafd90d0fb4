"""Hand_grip: joints stiff, squeeze with internal forces."""

from __future__ import annotations

from collections.abc import Mapping

from arm.hand.handling import Handling, Scene
from arm.hand.nodes.node import Step
from arm.hds import Event, NodeType, Parameter, ParameterValue

RAMP, SETTLE = 0.4, 0.2
"""Time for the force to build up, and to settle [s]."""


class HandGrip:
    """Goal region: the squeeze has built up. Domain: the goal region of ``Hand_grasp``."""

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._force = float(values["Force"])

    def enter(self, scene: Scene, hand: Handling) -> None:
        """From where the joints are."""
        hand.take(scene.at)
        self._took = 0.0

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Gripped."""
        self._took += scene.dt
        hand.squeeze = self._force * min(1.0, self._took / RAMP)
        if self._took <= RAMP + SETTLE:
            return Step(stand=True)
        hand.hold(scene)
        return Step("Gripped", stand=True)


TYPE = NodeType(
    "Hand_grip",
    parameters=(Parameter("Force", "N", 1.0, 60.0, 40.0, "Of each finger."),),
    events=(Event("Gripped", "The fingers squeeze."),),
    doc="Stiffen the joints and squeeze with forces that push nothing.",
    make=HandGrip,
)
