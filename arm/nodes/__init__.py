"""The node types of the arm, one file each. A new one is one file and its line here."""

from arm.hds import registry
from arm.nodes import goto_pose, hold, whiteboard_approach, whiteboard_circle, whiteboard_line
from arm.nodes.node import Context, Control, Step

REGISTRY = registry(
    hold.TYPE,
    goto_pose.TYPE,
    whiteboard_approach.TYPE,
    whiteboard_line.TYPE,
    whiteboard_circle.TYPE,
)

__all__ = ["REGISTRY", "Context", "Control", "Step"]
