"""Wait: joints still, for a time."""

from __future__ import annotations

from collections.abc import Mapping

from arm.grasping.hands import Hands
from arm.grasping.nodes.node import Step
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import Clock


class Wait:
    """No motion. Goal region: ``Time`` is over. Domain: the palms touch nothing."""

    needs_box = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._clock = Clock(float(values["Time"]))

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Press no more."""
        hands.reset()

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Timeout after ``Time``."""
        return Step(event="Timeout" if self._clock.step(scene.dt) else None)


TYPE = NodeType(
    "Wait",
    parameters=(Parameter("Time", "s", 0.0, 86400, doc="How long."),),
    events=(Event("Timeout", "Time is over."),),
    doc="Keep the joints still for a time.",
    make=Wait,
)
