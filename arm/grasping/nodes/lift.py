"""Grasp_lift: raise the box between the palms, weighing it as it comes."""

from __future__ import annotations

from collections.abc import Mapping

from arm.grasping.hands import Hands
from arm.grasping.nodes.carrying import GRIP, Grip, carried
from arm.grasping.nodes.node import Step, load
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

WEIGHING = 0.012
"""Height over which the box is weighed, slowly [m] ..."""
SLOWLY = 0.02
"""... at this speed [m/s]."""
RAMP = 0.5
"""Change of the speed [m/s^2]."""


class GraspLift:
    """Φ_comply with the line carried up.

    Grips harder as the load says, and gives up where the load asks for more than ``Grip``, or for
    more than the palms can hold. Goal region: ``Height`` above where it stood, held. Domain: the
    goal region of the compliance.
    """

    needs_box = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._height = float(values["Height"])
        self._speed = float(values["Speed"])
        self._grip = Grip(float(values["Grip"]))
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """From where the palms are."""
        hands.carry.capture(scene)
        hands.roll.capture(scene)
        hands.force.keep(scene)

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Lifted at the height, at rest; Too_heavy when the load says so."""
        carry = hands.carry
        left = self._height - carry.height
        limit = SLOWLY if carry.height < WEIGHING else self._speed
        limit = min(limit, (2.0 * RAMP * max(left, 0.0)) ** 0.5)
        carry.speed = min(carry.speed + RAMP * scene.dt, limit)
        carry.height = min(carry.height + carry.speed * scene.dt, self._height)
        move = carried(hands)
        heavy = self._grip.step(scene, hands)
        if heavy:
            return Step(move, "Too_heavy", heavy, lifted=True)
        event = None
        if left <= 1e-6 and float(carry.error(scene).max()) < 0.01:
            event = "Lifted"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(move, event, lifted=load(scene) > 1.0 and carry.height > 0.004)


TYPE = NodeType(
    "Grasp_lift",
    parameters=(
        Parameter("Height", "mm", 0.0, 0.5, 0.2, "Above where it stood."),
        Parameter("Speed", "mm/s", 0.005, 0.3, 0.1, "Of the box."),
        GRIP,
        TIMEOUT,
    ),
    events=(
        Event("Lifted", "The box is at the height."),
        Event("Too_heavy", "The load is more than the palms can hold."),
        TIMEOUT_EVENT,
    ),
    doc="Raise the box between the palms, weighing it as it comes.",
    make=GraspLift,
)
