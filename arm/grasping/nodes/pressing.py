"""What the pressing nodes share: the reference force, and what tells a box of another width."""

from __future__ import annotations

from arm.grasping.hands import Hands
from arm.grasping.scene import Scene
from arm.hds import Event, Parameter

FORCE = Parameter("Force", "N", 5.0, 60.0, 25.0, "Inward, of each palm.")
TOO_WIDE = Event("Too_wide", "Both palms press on something wider than the box should be.")
WIDER = 0.06
"""A box this much wider than stated is another one [m]."""
FIRM = 8.0
"""Palms that press less may have touched something in passing [N]."""
DEAD = 0.006
"""Of Φ_reach while palms press: asserted in a grip it would drag palms and box together [m]."""


def press(hands: Hands, force: float) -> None:
    """Set up objectives for palms in contact, or about to be."""
    hands.force.goal = force
    hands.reach.dead = DEAD
    hands.force.keep(None)


def too_wide(scene: Scene) -> str:
    """Why what is between the palms cannot be the box; empty if it can."""
    if not scene.feel.both or float(scene.feel.force.min()) < FIRM:
        return ""
    width, stated = scene.width, float(scene.size[1])
    if width <= stated + WIDER:
        return ""
    return f"what is between the palms is {width:.3f} m wide, not {stated:.3f} m"
