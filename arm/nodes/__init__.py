"""The node types of the arm, one file each. A new one is one file and its line here."""

from collections.abc import Callable

from arm.hds import Node, Program, registry
from arm.nodes import (
    drive_to,
    goto_ground,
    goto_platform,
    goto_pose,
    guarded_move,
    hold,
    retract,
    wait,
    whiteboard_approach,
    whiteboard_circle,
    whiteboard_line,
    whiteboard_path,
    whiteboard_press,
    whiteboard_wave,
    whiteboard_wipe,
)
from arm.nodes.build import builder
from arm.nodes.node import Context, Control, Step
from arm.nodes.quantities import QUANTITIES
from arm.nodes.wait import Wait

REGISTRY = registry(
    hold.TYPE,
    wait.TYPE,
    goto_pose.TYPE,
    goto_ground.TYPE,
    goto_platform.TYPE,
    retract.TYPE,
    drive_to.TYPE,
    guarded_move.TYPE,
    whiteboard_approach.TYPE,
    whiteboard_line.TYPE,
    whiteboard_circle.TYPE,
    whiteboard_path.TYPE,
    whiteboard_press.TYPE,
    whiteboard_wipe.TYPE,
    whiteboard_wave.TYPE,
    quantities=QUANTITIES,
)

build: Callable[[Node, Program], Control] = builder(REGISTRY)
"""The control of a node of a program; ValueError if it cannot be made, naming the node."""

__all__ = ["REGISTRY", "Context", "Control", "Step", "Wait", "build"]
