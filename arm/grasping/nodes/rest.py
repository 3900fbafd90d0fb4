"""Grasp_rest: both arms to their posture at rest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.grasping.hands import Hands, Move
from arm.grasping.nodes.node import Step
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

THERE = 0.08
"""Every joint within this of its place [rad]."""


class GraspRest:
    """Posture alone. Goal region: every joint within 0.08 rad. Domain: nothing in the way."""

    needs_box = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Press no more."""
        hands.reset()

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Rested where the joints are at their places."""
        event = None
        if float(np.abs(hands.posture.target - scene.palms.q).max()) < THERE:
            event = "Rested"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(Move(hands.posture), event)


TYPE = NodeType(
    "Grasp_rest",
    parameters=(TIMEOUT,),
    events=(Event("Rested", "Both arms are at rest."), TIMEOUT_EVENT),
    doc="Bring both arms to their posture at rest.",
    make=GraspRest,
)
