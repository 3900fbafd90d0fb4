"""The node types of two arms, one file each. A new one is one file and its line here."""

from typing import Any

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
from arm.nodes.build import build_from

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


def build(node: Node, program: Program) -> Control:
    """The control of a program's node.

    Raises:
        ValueError: it cannot be made; the text names the node.
    """
    made: Any = build_from(REGISTRY, node, program)
    control: Control = made
    return control


__all__ = ["REGISTRY", "Control", "Step", "build"]
