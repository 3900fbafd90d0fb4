"""The node types of two arms, one file each. A new one is one file and its line here."""

from collections.abc import Callable

from arm.grasping.nodes import (
    comply,
    drive_to_box,
    guarded_move,
    hold,
    lift,
    look,
    open,
    parallel,
    reach,
    rest,
    set_down,
    wait,
)
from arm.grasping.nodes.node import QUANTITIES, Control, Step
from arm.hds import Node, Program, registry
from arm.nodes.build import builder

REGISTRY = registry(
    wait.TYPE,
    look.TYPE,
    drive_to_box.TYPE,
    rest.TYPE,
    open.TYPE,
    reach.TYPE,
    guarded_move.TYPE,
    comply.TYPE,
    parallel.TYPE,
    lift.TYPE,
    hold.TYPE,
    set_down.TYPE,
    quantities=QUANTITIES,
)

build: Callable[[Node, Program], Control] = builder(REGISTRY)
"""The control of a node of a program; ValueError if it cannot be made, naming the node."""


__all__ = ["REGISTRY", "Control", "Step", "build"]
