"""The node types of an arm with a hand, one file each. A new one is one file and its line here."""

from collections.abc import Callable

from arm.hand.nodes import again, carry, drive, grasp, grip, lift, lower, reach, release, stay
from arm.hand.nodes.node import QUANTITIES, Control, Step
from arm.hds import Node, Program, registry
from arm.nodes.build import builder

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

build: Callable[[Node, Program], Control] = builder(REGISTRY)
"""The control of a node of a program; ValueError if it cannot be made, naming the node."""


__all__ = ["REGISTRY", "Control", "Step", "build"]
