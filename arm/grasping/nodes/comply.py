"""Grasp_comply: both palms flat on the sides of the box."""

from __future__ import annotations

from collections.abc import Mapping

from arm.grasping.hands import Hands, Move
from arm.grasping.nodes.node import Step
from arm.grasping.nodes.pressing import FORCE, TOO_WIDE, Width, press
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock


class GraspComply:
    """Φ_comply = Φ_m / Φ_f / Φ_reach (Platt et al., Eq 7).

    Goal region: that of the guarded move, with no more than 0.3 N m (0.8 N m once in) about the
    axes in each palm's face, for ``Settle``. Domain: the goal region of the guarded move.
    """

    needs_box = True

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._force = float(values["Force"])
        self._settle = float(values["Settle"])
        self._clock = Clock(float(values["Timeout"]))
        self._width = Width()

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Nothing has settled yet."""
        self._for = 0.0

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Complied after ``Settle`` inside the goal region."""
        press(hands, self._force, scene)
        hands.force.gaps[:] = -1.0
        hands.preshape.firm = False
        move = Move(hands.comply, (hands.roll, hands.preshape, hands.posture), presses=True)
        wide = self._width.step(scene)
        if wide:
            return Step(move, "Too_wide", wide)
        self._for = self._for + scene.dt if regions["comply"] else 0.0
        event = None
        if self._for >= self._settle:
            event = "Complied"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(move, event)


SETTLE = Parameter("Settle", "s", 0.0, 10.0, 0.1, "Time in the goal region.")

TYPE = NodeType(
    "Grasp_comply",
    parameters=(FORCE, SETTLE, TIMEOUT),
    events=(Event("Complied", "Both palms lie flat on the box."), TOO_WIDE, TIMEOUT_EVENT),
    doc="Turn both palms until they lie flat on the sides of the box.",
    make=GraspComply,
)
