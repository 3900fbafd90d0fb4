"""The discrete part of a program as the paper's A = (Q, E, delta, T, mu): plain data to analyse."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from arm.hds.nodetype import ParameterValue, Registry
from arm.hds.program import ABORT, END, Node, Program

Kind = Literal["event", "guard", "abort"]
"""What an edge is taken on."""


@dataclass(frozen=True)
class Edge:
    """One entry of the transition matrix T.

    Attributes:
        source: node it leaves.
        label: event, text of the guard, or ``Abort``.
        target: node it leads to.
        kind: what it is taken on.
        symbol: what specifications call it: the event, the guard's quantity, or ``Abort``.
        possible: False for an event that cannot happen in this node (``Timeout`` without the
            parameter): written, but no way.
    """

    source: str
    label: str
    target: str
    kind: Kind = "event"
    symbol: str = ""
    possible: bool = True


@dataclass(frozen=True)
class Discrete:
    """A = (Q, E, delta, T, mu).

    Attributes:
        nodes: Q, in the order of the source, ``End`` last if something leads there.
        initial: delta; one node here.
        terminals: mu.
        edges: T; the edges of one node stand in the order of the source, guards after events,
            its abort edge last.
    """

    nodes: tuple[str, ...]
    initial: str
    terminals: frozenset[str]
    edges: tuple[Edge, ...]

    @property
    def events(self) -> tuple[str, ...]:
        """E: every label, guards included, in the order they first appear."""
        return tuple(dict.fromkeys(edge.label for edge in self.edges))

    @cached_property
    def _out(self) -> Mapping[str, tuple[Edge, ...]]:
        out: dict[str, list[Edge]] = {name: [] for name in self.nodes}
        for edge in self.edges:
            out[edge.source].append(edge)
        return {name: tuple(edges) for name, edges in out.items()}

    def out(self, node: str) -> tuple[Edge, ...]:
        """The edges that leave a node, possible or not."""
        return self._out[node]

    def ways(self, abort: bool = True) -> dict[str, list[str]]:
        """Where each node can go by what can happen, with or without abort edges."""
        return {
            name: list(
                dict.fromkeys(
                    e.target for e in edges if e.possible and (abort or e.kind != "abort")
                )
            )
            for name, edges in self._out.items()
        }


def discrete(program: Program, types: Registry) -> Discrete:
    """The discrete part of a checked program.

    Args:
        program: the program.
        types: the node types it was checked with; they say which events can happen.
    """
    edges = [edge for node in program.nodes.values() for edge in _edges(node, program, types)]
    nodes = list(program.nodes)
    if any(edge.target == END.name for edge in edges):
        nodes.append(END.name)
    terminals = frozenset(name for name in nodes if program.node(name).terminal)
    return Discrete(tuple(nodes), program.initial, terminals, tuple(edges))


def _edges(node: Node, program: Program, types: Registry) -> Iterable[Edge]:
    if node.terminal:
        return
    for event, target in node.transitions.items():
        possible = _can_happen(node.type, event, node.parameters, types)
        yield Edge(node.name, event, target, "event", event, possible)
    for guard in node.guards:
        yield Edge(node.name, guard.text, guard.target, "guard", guard.quantity)
    yield Edge(node.name, ABORT, program.abort, "abort", ABORT)


def _can_happen(
    type_name: str, event: str, values: Mapping[str, ParameterValue], types: Registry
) -> bool:
    """Whether a node can raise an event: the parameter the event needs, if any, is set."""
    node_type = types.get(type_name)
    declared = node_type.event(event) if node_type else None
    if node_type is None or declared is None or declared.needs is None:
        return True
    parameter = node_type.parameter(declared.needs)
    return parameter is None or values.get(parameter.name) != parameter.default
