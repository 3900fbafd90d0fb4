"""Hand_carry: take what is held above its goal while the platform drives there, too."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from arm.hand.handling import Handling, Scene
from arm.hand.moving import seen_from
from arm.hand.nodes.drive import DISTANCE, TOLERANCE, Arrival, before
from arm.hand.nodes.lift import eased
from arm.hand.nodes.node import Step
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

RAMP = 0.3
"""Change of the speed [m/s^2]."""
NEAR, FAR = 0.55, 0.65
"""Wrist to shoulder: the hand slows from the first, and does not go further out than the second
[m]."""


class HandCarry:
    """A straight way of the palm in the world; neither arm nor platform waits for the other.

    Goal region: the bottle above its goal, the platform at rest before it. Domain: the bottle
    lifted, nothing in its way.
    """

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._speed = float(values["Speed"])
        self._distance = float(values["Distance"])
        self._tolerance = float(values["Tolerance"])
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, scene: Scene, hand: Handling) -> None:
        """From where the references are."""
        hand.carrier.capture(hand.reference, scene.base)
        task = hand.task
        x, y = task.goal
        self._to = np.array([*(np.array([x, y]) + hand.offset), hand.carrier.p[2]])
        self._arrival = Arrival(before(x, y, task.facing, self._distance), self._tolerance)
        self._now = 0.0

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Arrived when hand and platform are there."""
        way = self._to - hand.carrier.p
        left = float(np.linalg.norm(way))
        speed = eased(self._now, self._speed, left, RAMP, scene.dt)
        ahead = way / max(left, 1e-9)
        self._now = min(speed, max(self._room(scene, hand, ahead), self._now - RAMP * scene.dt))
        hand.go(scene, self._now * ahead)
        there = self._arrival.step(scene.dt, scene.base) and left < 1e-3
        event = None
        if there:
            event = "Arrived"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(event, goal=None if event else self._arrival.goal)

    def _room(self, scene: Scene, hand: Handling, ahead: np.ndarray) -> float:
        """Speed that the arm's reach allows [m/s]."""
        p = seen_from(scene.base, hand.carrier.p)
        out = math.hypot(p[0], p[1])
        c, s = math.cos(scene.base.pose[2]), math.sin(scene.base.pose[2])
        away = (c * ahead[0] + s * ahead[1]) * p[0] + (c * ahead[1] - s * ahead[0]) * p[1]
        if away <= 0.0:
            return self._speed
        return self._speed * min(1.0, max(0.0, (FAR - out) / (FAR - NEAR)))


TYPE = NodeType(
    "Hand_carry",
    parameters=(
        Parameter("Speed", "mm/s", 0.01, 0.5, 0.2, "Of the hand."),
        DISTANCE,
        TOLERANCE,
        TIMEOUT,
    ),
    events=(Event("Arrived", "Hand and platform are there."), TIMEOUT_EVENT),
    doc="Take what is held above its goal, upright, while the platform drives there.",
    make=HandCarry,
)
