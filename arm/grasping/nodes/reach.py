"""Grasp_reach: both palms onto the line through the box, beside it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.grasping.hands import Hands, Move
from arm.grasping.nodes.node import Step
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

AROUND = 0.06
"""Farther from the line than this a palm goes around outside [m]."""


def begin(hands: Hands, scene: Scene) -> float:
    """Start a reach from rest, all of it in one time; the time [s]."""
    took = hands.reach.begin(scene)
    hands.clearance.glide.begin(took)
    hands.preshape.glide.begin(took)
    return took


class GraspReach:
    """Φ_reach, with clearance and preshape below it.

    Goal region: both palms within 14 mm of the line (24 mm once in). Domain: the goal region of the
    approach, palms anywhere the arms can be, the box between them or ahead of them; palms that
    touch open first, so that none drags the box along.
    """

    needs_box = True

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._near = float(values["Clearance"])
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Press no more."""
        hands.reset()
        begin(hands, scene)
        self._opening = any(scene.feel.touches)

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Reached inside the goal region."""
        errors = hands.reach.error(scene)
        hands.reach.dead = 0.0
        if self._opening and not any(scene.feel.touches):
            self._opening = False
            begin(hands, scene)
        around = np.clip((errors - 0.02) / (AROUND - 0.02), 0.0, 1.0)
        hands.clearance.gaps = self._near + (AROUND - self._near) * around
        hands.preshape.firm = True
        below = (hands.clearance, hands.preshape, hands.posture)
        if self._opening:  # off the box first
            move = Move(hands.clearance, (hands.preshape, hands.posture))
        else:
            move = Move(hands.reach, below)
        event = None
        if regions["reach"] and not self._opening:
            event = "Reached"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(move, event)


TYPE = NodeType(
    "Grasp_reach",
    parameters=(
        Parameter("Clearance", "mm", 0.01, 0.1, 0.045, "Palms to the sides of the box."),
        TIMEOUT,
    ),
    events=(Event("Reached", "Both palms are on the line."), TIMEOUT_EVENT),
    doc="Put both palms on the line through the box, beside it.",
    make=GraspReach,
)
