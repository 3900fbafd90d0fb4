"""What guards may look at in a node of any type."""

from __future__ import annotations

import math

from arm.hds import TIME, Quantity
from arm.nodes.node import Context, Step

QUANTITIES = (
    Quantity("Force", "cN", "Pressing force on the board, low-pass filtered."),
    Quantity("Distance", "mm", "Of the tip in front of the board; negative behind it."),
    Quantity("Speed", "mm/s", "Of the tip over the board, as the node asks for it."),
    Quantity("Reach_margin", "mm", "Left before the arm is stretched out."),
)
"""Offered by every node type besides ``TIME``; the names are those of ``quantities``."""


def quantities(context: Context, step: Step, time: float, force: float) -> dict[str, float]:
    """The values now [SI].

    Those that the node's type declares beside these are in the step.

    Args:
        context: of this tick.
        step: what the node answered at it.
        time: since the node was entered, interruptions not counted [s].
        force: pressing force, filtered [N].
    """
    return {
        TIME.name: time,
        "Force": force,
        "Distance": float(context.tip[2]),
        "Speed": math.hypot(*step.velocity),
        "Reach_margin": context.reach_margin,
        **step.measures,
    }
