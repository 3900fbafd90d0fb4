"""What a running node of the grasp is, and what guards may look at in any of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from arm.grasping.hands import Hands, Move
from arm.grasping.regions import Regions
from arm.grasping.scene import Scene
from arm.hds import TIME, Quantity

Array = NDArray[np.float64]

STILL = Move(None)


@dataclass
class Step:
    """What a node answers at a tick.

    Attributes:
        move: what the hands are to do.
        event: raised at this tick, or None.
        reason: why, where the event's name does not say it all.
        goal: where the platform is asked to be, X_OB as x, y [m], heading [rad]; None: nowhere.
        lifted: the box is off the table.
    """

    move: Move = field(default_factory=lambda: STILL)
    event: str | None = None
    reason: str = ""
    goal: Array | None = None
    lifted: bool = False


class Control(Protocol):
    """The continuous part of a node.

    Attributes:
        needs_box: it cannot go on without knowing where the box is.
    """

    needs_box: bool

    def enter(self, scene: Scene, hands: Hands, regions: Regions) -> None:
        """Start here; called once before the first update."""
        ...

    def update(self, scene: Scene, hands: Hands, regions: Regions) -> Step:
        """Advance one tick."""
        ...


QUANTITIES = (
    Quantity("In_approach", "1", "1 in the goal region of the approach, 0 outside."),
    Quantity("In_reach", "1", "1 in that of the reach: both palms on the line, 0 outside."),
    Quantity("In_contact", "1", "1 in that of the guarded move: both palms press, 0 outside."),
    Quantity("In_comply", "1", "1 in that of the compliance: both palms lie flat, 0 outside."),
    Quantity("Touching", "1", "How many palms touch something."),
    Quantity("Load", "N", "Weight that the palms carry."),
    Quantity("Line", "mm", "Of the palm farther from the line through the box."),
    Quantity("Distance", "m", "Of the box from the middle of the platform."),
    Quantity("Unseen", "s", "Time since the box was last seen."),
)
"""Offered by every node type besides ``TIME``."""


def quantities(scene: Scene, regions: Regions, time: float) -> Mapping[str, float]:
    """The values now [SI]; not a number where there is none, which no guard holds for.

    Args:
        scene: of this tick.
        regions: goal regions.
        time: since the node was entered [s].
    """
    box = scene.box
    return {
        TIME.name: time,
        "In_approach": float(regions["approach"]),
        "In_reach": float(regions["reach"]),
        "In_contact": float(regions["contact"]),
        "In_comply": float(regions["comply"]),
        "Touching": float(sum(scene.feel.touches)),
        "Load": load(scene),
        "Line": regions.line,
        "Distance": math.nan if box is None else math.hypot(box.p[0], box.p[1]),
        "Unseen": scene.box_age,
    }


def load(scene: Scene) -> float:
    """Weight on both palms [N]."""
    return -float(sum((scene.palms.R[i] @ scene.feel.load[i])[2] for i in range(2)))
