"""Hand_lift: straight up with what is held."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.hand.handling import Handling, Scene
from arm.hand.nodes.node import Step
from arm.hds import Event, NodeType, Parameter, ParameterValue

RAMP = 0.4
"""Change of the speed [m/s^2]."""


class HandLift:
    """The palm goes up in the world. Goal region: ``Height`` up. Domain: the squeeze."""

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._height, self._speed = float(values["Height"]), float(values["Speed"])

    def enter(self, scene: Scene, hand: Handling) -> None:
        """From where the references are."""
        hand.carrier.capture(hand.reference, scene.base)
        self._left = self._height + hand.stood - float(hand.carrier.p[2])
        self._now = 0.0

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Lifted at the height."""
        self._now = eased(self._now, self._speed, self._left, RAMP, scene.dt)
        self._left -= self._now * scene.dt
        hand.go(scene, np.array([0.0, 0.0, self._now]))
        return Step("Lifted" if self._left < 1e-4 else None, stand=True)


def eased(now: float, speed: float, left: float, ramp: float, dt: float) -> float:
    """The next speed on a way that begins and ends at rest [m/s]."""
    slow = (2.0 * ramp * max(left, 0.0)) ** 0.5
    return min(now + ramp * dt, speed, slow, max(left, 0.0) / dt)


TYPE = NodeType(
    "Hand_lift",
    parameters=(
        Parameter("Height", "mm", 0.01, 0.4, 0.12, "Above where it stood."),
        Parameter("Speed", "mm/s", 0.005, 0.5, 0.12, "Of the palm."),
    ),
    events=(Event("Lifted", "The bottle is at the height."),),
    doc="Raise what is held straight up in the world.",
    make=HandLift,
)
