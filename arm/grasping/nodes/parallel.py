"""Grasp_parallel: reach, guarded move and compliance at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

import numpy as np

from arm.grasping.hands import Composition, Hands, Move
from arm.grasping.nodes.comply import SETTLE
from arm.grasping.nodes.node import Step
from arm.grasping.nodes.pressing import FORCE, TOO_WIDE, Width, press
from arm.grasping.nodes.reach import begin
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

FAR, ON = 0.17, 0.07
"""Distances from the line between which the palms close in: fingertips pass the box's front corner
at the first [m]."""
OUTSIDE, BESIDE = 0.035, 0.005
"""From the box's sides, kept by palms at these distances [m]."""
SOONER = 0.88
"""Share of the time of the reach in which the palms come to the sides of the box [1]."""


class GraspParallel:
    """Φ_comply / Φ_gm / Φ_reach, which the algebra makes Φ_m / Φ_f / Φ_reach (Eq 8 to 11).

    Goal region: that of the compliance. Domain: the goal region of the approach. Palms far from
    the line stay outside the box; what closes the gap is Φ_f, whose goal region begins there.
    """

    needs_box = True

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._force = float(values["Force"])
        self._settle = float(values["Settle"])
        self._composition = cast(Composition, str(values["Composition"]))
        self._clock = Clock(float(values["Timeout"]))
        self._width = Width()

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Nothing has settled yet."""
        self._for = 0.0
        hands.reset()
        hands.force.glide.begin(SOONER * begin(hands, scene))

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Complied after ``Settle`` inside the goal region of the compliance."""
        press(hands, self._force, scene, regions["reach"])
        if not any(scene.feel.touches):
            hands.reach.dead = 0.0
        errors = hands.reach.error(scene)
        share = (errors - ON) / (FAR - ON)
        gaps = BESIDE + (OUTSIDE - BESIDE) * np.minimum(share, 1.0)
        hands.force.gaps = np.where(share > 0.0, gaps, -1.0)
        hands.force.quick = True
        hands.preshape.firm = False
        below = (hands.roll, hands.preshape, hands.posture)
        if self._composition == "sum":
            below = (hands.roll, hands.preshape)  # type: ignore[assignment]
        move = Move(hands.parallel, below, self._composition, presses=True)
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


COMPOSITION = Parameter(
    "Composition",
    kind="word",
    default="null_space",
    choices=("null_space", "sum"),
    doc="Subject-to by null spaces, or the plain sum of outputs.",
)

TYPE = NodeType(
    "Grasp_parallel",
    parameters=(FORCE, SETTLE, COMPOSITION, TIMEOUT),
    events=(Event("Complied", "Both palms lie flat on the box."), TOO_WIDE, TIMEOUT_EVENT),
    doc="Reach, touch and comply at once.",
    make=GraspParallel,
)
