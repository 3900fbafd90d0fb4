"""Look_for_box: stand and look until the box is known, and say what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping

from arm.grasping.hands import Hands, Move
from arm.grasping.nodes.node import Step
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import Clock

TILTED = 0.5
"""A box that leans more than this stands on another side [rad]."""
HEIGHTS = (0.66, 1.05)
"""Of a box's middle that both palms can reach [m]."""
OPEN_WIDTH = 0.40
"""Between palms opened as far as they reach around a box, less the room to get there [m]."""


class LookForBox:
    """Joints towards their rest, eyes on the box.

    Goal region: the box known for ``Time``, standing, where the palms can take it. Domain: any.
    """

    needs_box = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._patience = Clock(float(values["Patience"]))
        self._looks = Clock(float(values["Time"]))

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Press no more."""
        hands.reset()

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Seen, or what is wrong."""
        move = Move(hands.posture)
        late = self._patience.step(scene.dt)
        box = scene.box
        if box is None:
            return Step(move, "Missing" if late else None, "no box was seen" if late else "")
        if not self._looks.step(scene.dt):
            return Step(move)
        width, z = float(scene.size[1]), float(box.p[2])
        if width > OPEN_WIDTH:
            reason = f"the box is {width:.2f} m wide; the palms open to {OPEN_WIDTH:.2f} m"
            return Step(move, "Too_wide", reason)
        if box.tilt > TILTED:
            return Step(move, "On_side", f"the box leans by {box.tilt:.1f} rad")
        if not HEIGHTS[0] <= z <= HEIGHTS[1]:
            reason = f"the box is at {z:.2f} m, the palms reach {HEIGHTS[0]} to {HEIGHTS[1]} m"
            return Step(move, "Out_of_reach", reason)
        return Step(move, "Seen", "")


TYPE = NodeType(
    "Look_for_box",
    parameters=(
        Parameter("Time", "s", 0.0, 60, 0.3, "To look at it."),
        Parameter("Patience", "s", 0.1, 3600, 5.0, "To wait for it to be seen."),
    ),
    events=(
        Event("Seen", "The box is known, and can be taken as it is."),
        Event("Missing", "No box was seen in all this time."),
        Event("On_side", "The box does not stand upright."),
        Event("Too_wide", "The palms do not open as wide as the box is."),
        Event("Out_of_reach", "The box is higher or lower than the palms reach."),
    ),
    doc="Stand and look until the box is known, and say what is wrong with it.",
    make=LookForBox,
)
