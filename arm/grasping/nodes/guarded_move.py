"""Grasp_guarded_move: both palms inward along the line until they press."""

from __future__ import annotations

from collections.abc import Mapping

from arm.grasping.hands import Hands, Move
from arm.grasping.nodes.node import Step
from arm.grasping.nodes.pressing import FORCE, TOO_WIDE, Width, press
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock


class GraspGuardedMove:
    """Φ_gm = Φ_f / Φ_reach (Platt et al., Eq 6).

    Goal region: both palms press with 15 N (9 N once in), on the line. Domain: the goal region of
    the reach.
    """

    needs_box = True

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._force = float(values["Force"])
        self._clock = Clock(float(values["Timeout"]))
        self._width = Width()

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Nothing is held yet."""
        hands.roll.release()

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Touched inside the goal region."""
        press(hands, self._force, scene)
        hands.force.gaps[:] = -1.0
        hands.preshape.firm = True
        move = Move(hands.gm, (hands.preshape, hands.posture), presses=True)
        wide = self._width.step(scene)
        if wide:
            return Step(move, "Too_wide", wide)
        event = None
        if regions["contact"]:
            event = "Touched"
        elif self._clock.step(scene.dt):
            event = "Timeout"
        return Step(move, event)


TYPE = NodeType(
    "Grasp_guarded_move",
    parameters=(FORCE, TIMEOUT),
    events=(Event("Touched", "Both palms press on the box."), TOO_WIDE, TIMEOUT_EVENT),
    doc="Move both palms inward along the line until they press on the box.",
    make=GraspGuardedMove,
)
