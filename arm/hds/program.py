"""A checked program: what the runtime runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from arm.hds.finding import Finding
from arm.hds.nodetype import ParameterValue


@dataclass(frozen=True)
class Node:
    """One node of a program.

    Attributes:
        name: its name.
        type: name of its node type.
        parameters: every parameter of the type: SI number, integer or word; defaults filled in.
        transitions: event to name of the next node.
        terminal: whether the program ends on entering it.
        line: line of its BEGIN in the source; 0 for the predefined ``End``.
    """

    name: str
    type: str
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)
    transitions: Mapping[str, str] = field(default_factory=dict)
    terminal: bool = False
    line: int = 0


END = Node("End", "End", terminal=True)
"""The predefined terminal node; a program goes there without declaring it."""


@dataclass(frozen=True)
class Program:
    """A program without errors.

    Attributes:
        nodes: declared nodes by name, in the order of the source.
        initial: name of the node that runs first.
        interface: the robot interface the program is for.
        path: where the source came from, as given to the checker.
        sha256: digest of the source text in UTF-8, for recordings and trial results.
        warnings: what the checker found that is no error.
    """

    nodes: Mapping[str, Node]
    initial: str
    interface: str
    path: str
    sha256: str
    warnings: tuple[Finding, ...] = ()

    def node(self, name: str) -> Node:
        """The node called ``name``, ``End`` included.

        Raises:
            KeyError: there is none.
        """
        return END if name == END.name else self.nodes[name]
