"""Grasp_set_down: lower the box until something else carries it."""

from __future__ import annotations

from collections.abc import Mapping

from arm.grasping.hands import Hands
from arm.grasping.nodes.carrying import GRIP, Grip, carried
from arm.grasping.nodes.node import Step, load
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

RAMP = 0.3
"""Change of the speed [m/s^2]."""
TOUCHDOWN = 0.03
"""Above where it stood the box comes down slowly from here on [m] ..."""
SLOWLY = 0.03
"""... at this speed [m/s]."""
BELOW = -0.06
"""No table by here: it was taken away [m]."""
STANDS = 0.4
"""Share of its weight that is left on the palms when it stands [1]."""


class GraspSetDown:
    """Φ_comply with the line carried down.

    Goal region: less than 0.4 of the weight on the palms. Domain: the box between the palms.
    """

    needs_box = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._speed = float(values["Speed"])
        self._grip = Grip(float(values["Grip"]))
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """From where the box is; what is on the palms now is its weight."""
        self._weight = load(scene)
        hands.carry.speed = 0.0

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Down where something carries it."""
        carry = hands.carry
        limit = SLOWLY if carry.height < TOUCHDOWN else self._speed
        carry.speed = max(carry.speed - RAMP * scene.dt, -limit)
        carry.height += carry.speed * scene.dt
        self._grip.step(scene, hands)
        event = None
        if carry.height < 0.0 and load(scene) < STANDS * self._weight:
            event = "Down"
        elif carry.height < BELOW:
            event = "No_table"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(carried(hands), event, lifted=event is None)


TYPE = NodeType(
    "Grasp_set_down",
    parameters=(Parameter("Speed", "mm/s", 0.005, 0.2, 0.08, "Of the box."), GRIP, TIMEOUT),
    events=(
        Event("Down", "The box stands."),
        Event("No_table", "Nothing carries it 60 mm below where it stood; it is still held."),
        TIMEOUT_EVENT,
    ),
    doc="Lower the box until something else carries it.",
    make=GraspSetDown,
)
