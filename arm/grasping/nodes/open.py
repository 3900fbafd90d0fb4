"""Grasp_open: palms off the box and to its sides."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.grasping.hands import Hands, Move
from arm.grasping.model import SIDES
from arm.grasping.nodes.node import Step
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

CLOSE = 0.015
"""Nearer than this to where they should be the palms are there [m]."""


class GraspOpen:
    """Clearance alone: along the line, outwards.

    Goal region: both palms ``Clearance`` beside the box. Domain: the box on the table.
    """

    needs_box = True

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._gap = float(values["Clearance"])
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Press no more."""
        hands.reset()
        hands.clearance.glide.begin()
        hands.preshape.glide.begin()

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Opened where the palms are clear."""
        assert scene.box is not None
        hands.clearance.gaps = np.full(2, self._gap)
        hands.preshape.firm = True
        box = scene.box
        face = 0.5 * float(box.size[1]) + float(scene.half_palm[1]) + self._gap
        clear = all(
            side * float(box.across @ (p - box.p)) > face - CLOSE
            for side, p in zip(SIDES, scene.palms.p, strict=True)
        )
        event = None
        if clear and not any(scene.feel.touches):
            event = "Opened"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(Move(hands.clearance, (hands.preshape, hands.posture)), event)


TYPE = NodeType(
    "Grasp_open",
    parameters=(
        Parameter("Clearance", "mm", 0.01, 0.2, 0.08, "Palms to the sides of the box."),
        TIMEOUT,
    ),
    events=(Event("Opened", "Both palms are clear of the box."), TIMEOUT_EVENT),
    doc="Take both palms off the box, to its sides.",
    make=GraspOpen,
)
