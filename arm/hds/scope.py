"""What a node is checked against: the types, nodes and constants there are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from arm.hds.constants import Constants
from arm.hds.finding import Report
from arm.hds.names import hint
from arm.hds.nodetype import NodeType
from arm.hds.syntax import Name


@dataclass(frozen=True)
class Scope:
    """The surroundings of every node of a program.

    Attributes:
        types: the node types there are.
        targets: names a transition may go to, as keys in the order they are listed.
        constants: the program's constants.
        report: where findings go.
        partial: an included file could not be read, so that a name nobody knows may be there.
    """

    types: Mapping[str, NodeType]
    targets: Mapping[str, object]
    constants: Constants
    report: Report
    partial: bool = False

    def knows_target(self, target: Name) -> bool:
        """Whether a transition may go there; reported if not."""
        if target.text in self.targets:
            return True
        if not self.partial:
            message = f"there is no node '{target.text}' to go to"
            help = hint(target.text, self.targets)
            self.report.error("unknown-target", message, target.span, help)
        return False
