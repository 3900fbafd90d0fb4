"""The node types of an arm with a hand, one file each. A new one is one file and its line here."""

from typing import Any

from arm.hand.nodes import again, carry, drive, grasp, grip, lift, lower, reach, release, stay
from arm.hand.nodes.node import QUANTITIES, Control, Step
from arm.hds import Node, Program, registry
from arm.nodes.build import build_from

REGISTRY = registry(
    drive.TYPE,
    reach.TYPE,
    grasp.TYPE,
    again.TYPE,
    grip.TYPE,
    lift.TYPE,
    stay.TYPE,
    carry.TYPE,
    lower.TYPE,
    release.TYPE,
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
