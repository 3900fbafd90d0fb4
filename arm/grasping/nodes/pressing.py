"""What the pressing nodes share: the reference force, and what tells a box of another width."""

from __future__ import annotations

import numpy as np

from arm.grasping.hands import Hands
from arm.grasping.scene import Scene
from arm.hds import Event, Parameter

FORCE = Parameter("Force", "N", 5.0, 60.0, 25.0, "Inward, of each palm.")
TOO_WIDE = Event("Too_wide", "Both palms press on something wider than the box should be.")
WIDER = 0.06
"""A box this much wider than stated is another one [m]."""
STRAIGHT = 0.97
"""Cosine between a palm's normal and the line, of a palm that is not askew [1]."""
LASTS = 0.06
"""Pressed for this long it is no push that passes [s]."""
FIRM = 8.0
"""Palms that press less may have touched something in passing [N]."""
DEAD, GRIPPED_DEAD = 0.006, 0.022
"""Of Φ_reach while palms press, and while both grip: asserted in a grip it would drag palms and box
along together, and turn the box [m]."""
GRIPS = 10.0
"""Force of both palms from which they grip [N]."""


def press(hands: Hands, force: float, scene: Scene, on_line: bool = True) -> None:
    """Set up objectives for palms in contact, or about to be.

    Args:
        hands: whose.
        force: to press with once on the line [N].
        scene: of this tick.
        on_line: the palms are in the goal region of the reach. Until they are they press lightly,
            and slide along the box: with the wide dead zone of a grip they would stay outside.
    """
    hands.force.goal = force if on_line else hands.force.LIGHT
    hands.force.quick = False
    gripped = on_line and scene.feel.both and float(scene.feel.force.min()) > GRIPS
    hands.reach.dead = GRIPPED_DEAD if gripped else DEAD
    hands.force.keep(None)


class Width:
    """Tells a box of another width than stated: palms upright beside it press too far apart."""

    def __init__(self) -> None:
        self._for = 0.0

    def step(self, scene: Scene) -> str:
        """Why what is between the palms cannot be the box; empty if it can."""
        width, stated = scene.width, float(scene.size[1])
        # one that was pushed askew presses with an edge
        across = np.zeros(3) if scene.box is None else scene.box.across
        askew = min(float(R[:, 1] @ across) for R in scene.palms.R) < STRAIGHT
        firm = scene.feel.both and float(scene.feel.force.min()) >= FIRM
        wide = firm and not askew and width > stated + WIDER
        self._for = self._for + scene.dt if wide else 0.0
        if self._for < LASTS:
            return ""
        return f"what is between the palms is {width:.3f} m wide, not {stated:.3f} m"
