"""The node types of the platform, one file each. A new one is one file and its line here."""

from arm.hds import Quantity, registry
from base.nodes import dock, drive_straight, drive_to, hold, turn_to, wait
from base.nodes.node import Context, Control, Step
from base.nodes.wait import Wait

QUANTITIES = (
    Quantity("Goal_distance", "m", "Distance of the task's goal; no guard holds without one."),
    Quantity("Object_distance", "m", "Distance of the task's object, likewise."),
)
"""What guards may look at in a node of any type, besides ``Time``."""

REGISTRY = registry(
    turn_to.TYPE,
    drive_straight.TYPE,
    drive_to.TYPE,
    dock.TYPE,
    hold.TYPE,
    wait.TYPE,
    quantities=QUANTITIES,
)

__all__ = ["QUANTITIES", "REGISTRY", "Context", "Control", "Step", "Wait"]
