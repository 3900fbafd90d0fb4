"""Hand_release: squeeze no more, open, draw back along the palm's own axis."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.hand.handling import Handling, Scene
from arm.hand.model import FLEX
from arm.hand.nodes.lift import eased
from arm.hand.nodes.node import Step
from arm.hds import Event, NodeType, Parameter, ParameterValue

RAMP = 0.4
"""Time for the squeeze to fade [s]."""
RATE = 0.5
"""Of the fingers [rad/s]."""


class HandRelease:
    """Goal region: the open hand ``Back`` away. Domain: the bottle stands."""

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._back, self._speed = float(values["Back"]), float(values["Speed"])
        self._open = float(values["Open"])

    def enter(self, scene: Scene, hand: Handling) -> None:
        """The palm stays where it is in the world."""
        hand.take(scene.at)
        hand.carrier.capture(hand.reference, scene.base)
        self._squeeze, self._took, self._now, self._left = hand.squeeze, 0.0, 0.0, self._back

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Released."""
        self._took += scene.dt
        hand.squeeze = self._squeeze * max(0.0, 1.0 - self._took / RAMP)
        velocity = np.zeros(3)
        if self._took > RAMP + 0.1:
            flex = hand.reference[FLEX]
            hand.reference[FLEX] = np.maximum(flex - RATE * scene.dt, np.minimum(flex, self._open))
            if float(hand.reference[FLEX].max()) <= self._open + 1e-6:
                self._now = eased(self._now, self._speed, self._left, 0.4, scene.dt)
                self._left -= self._now * scene.dt
                velocity = -self._now * hand.carrier.R[:, 2]
        hand.go(scene, velocity)
        return Step("Released" if self._left < 1e-4 else None, stand=True)


TYPE = NodeType(
    "Hand_release",
    parameters=(
        Parameter("Back", "mm", 0.02, 0.3, 0.15, "How far the hand draws back."),
        Parameter("Speed", "mm/s", 0.01, 0.5, 0.1, "Of that."),
        Parameter("Open", "rad", 0.0, 1.5, 0.45, "Flexion of the open fingers."),
    ),
    events=(Event("Released", "The open hand is away."),),
    doc="Let go of what stands, and draw the open hand back.",
    make=HandRelease,
)
