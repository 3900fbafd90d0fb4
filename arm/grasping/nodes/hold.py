"""Grasp_hold: keep the box where it is, between the palms."""

from __future__ import annotations

from collections.abc import Mapping

from arm.grasping.hands import Hands
from arm.grasping.nodes.carrying import GRIP, Grip, carried
from arm.grasping.nodes.node import Step
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import Clock


class GraspHold:
    """Φ_comply with the line kept where it was carried to.

    Goal region: the box held for ``Time``. Domain: the box between the palms, lifted.
    """

    needs_box = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._clock = Clock(float(values["Time"]))
        self._grip = Grip(float(values["Grip"]))

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Where it is."""
        hands.carry.speed = 0.0

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Held after ``Time``; never, with none given."""
        self._grip.step(scene, hands)
        event = "Held" if self._clock.step(scene.dt) else None
        return Step(carried(hands), event, lifted=True)


TYPE = NodeType(
    "Grasp_hold",
    parameters=(
        Parameter("Time", "s", 0.0, 86400, 5.0, "How long."),
        GRIP,
    ),
    events=(Event("Held", "Time is over."),),
    doc="Keep the box where it is, between the palms.",
    make=GraspHold,
)
