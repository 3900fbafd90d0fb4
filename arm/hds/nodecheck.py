"""What the checker knows of one node while it checks the others."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from arm.hds.constants import Constants
from arm.hds.finding import Report
from arm.hds.nodetype import NodeType, ParameterValue
from arm.hds.program import Guard, Node
from arm.hds.syntax import Assignment, Block, Span


@dataclass
class NodeCheck:
    """What came of checking one node, and what a node that is ``LIKE`` it takes over.

    Attributes:
        block: the node as written.
        type: its node type; None if that is missing or unknown.
        certain: False if it may have more ways than could be read, so that nothing may be
            concluded from those it lacks.
        settings: what it sets or takes over, by parameter.
        values: the settings that are right [SI].
        given: parameters it sets or means to set.
        transitions: event to target.
        impossible: those of its events that cannot happen.
        guards: guards and where they are written, in order.
    """

    block: Block
    type: NodeType | None
    certain: bool = True
    settings: dict[str, Assignment] = field(default_factory=dict)
    values: dict[str, ParameterValue] = field(default_factory=dict)
    given: set[str] = field(default_factory=set)
    transitions: dict[str, str] = field(default_factory=dict)
    impossible: set[str] = field(default_factory=set)
    guards: list[tuple[Guard, Span]] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The node's name; empty if it has none."""
        return self.block.names[0].text if self.block.names else ""

    @property
    def terminal(self) -> bool:
        """Whether the program ends in it."""
        return self.type is not None and self.type.terminal

    @property
    def raised(self) -> list[str]:
        """Nodes it can go to by events that can happen in it, perhaps at once."""
        return [t for event, t in self.transitions.items() if event not in self.impossible]

    @property
    def ways(self) -> list[str]:
        """Nodes it can go to; by a guard only after a tick."""
        return [*self.raised, *(guard.target for guard, _ in self.guards)]

    def node(self, constants: Constants, report: Report) -> Node:
        """The node of the checked program; to be used if nothing was wrong."""
        places = {name: constants.origin(each.value) for name, each in self.settings.items()}
        parameters = {
            p.name: value
            for p in (self.type.parameters if self.type else ())
            if (value := self.values.get(p.name, p.default)) is not None
        }
        return Node(
            name=self.name,
            type=self.type.name if self.type else "",
            parameters=parameters,
            transitions=self.transitions,
            terminal=self.terminal,
            line=self.block.span.line,
            guards=tuple(guard for guard, _ in self.guards),
            file=report.name(self.block.span),
            like=self.block.likes[0].text if self.block.likes else "",
            places={k: replace(span, file=report.name(span)) for k, span in places.items()},
        )
