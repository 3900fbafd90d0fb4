"""What a picture of a program shows, before anything has a place: boxes and arrows with text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from arm.hds.discrete import discrete
from arm.hds.explain import settings
from arm.hds.finding import Finding
from arm.hds.nodetype import Registry
from arm.hds.program import END, Program

SHOWN = 4
"""Parameters shown in a box at most."""


@dataclass(frozen=True)
class Box:
    """A node.

    Attributes:
        name: its name.
        type: its type; empty for ``End`` and for a node nobody declared.
        lines: its parameters that differ from the type's defaults.
        initial: the program starts here.
        terminal: the program ends here.
        findings: what the check says about it.
    """

    name: str
    type: str = ""
    lines: tuple[str, ...] = ()
    initial: bool = False
    terminal: bool = False
    findings: tuple[Finding, ...] = ()

    @property
    def severity(self) -> str:
        """``error``, ``warning``, or empty."""
        worst = sorted({finding.severity for finding in self.findings})
        return worst[0] if worst else ""


@dataclass(frozen=True)
class Arrow:
    """Everything that leads from one node to another.

    Attributes:
        lines: an event or guard each.
        findings: what the check says about these transitions.
        faint: it never happens.
    """

    source: str
    target: str
    lines: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    faint: bool = False


@dataclass(frozen=True)
class Sketch:
    """A picture without places.

    Attributes:
        title: name of the program, and what no arrow says.
        boxes: in the order of the source.
        arrows: none twice between the same two nodes in the same direction.
    """

    title: str
    boxes: tuple[Box, ...]
    arrows: tuple[Arrow, ...]


def sketch(program: Program, types: Registry, findings: Iterable[Finding] = ()) -> Sketch:
    """What to show of a checked program.

    Args:
        program: the program.
        types: the node types it was checked with.
        findings: what to mark besides the program's own warnings.
    """
    found = list(dict.fromkeys([*program.warnings, *findings]))
    automaton = discrete(program, types)
    boxes = []
    for name in automaton.nodes:
        node = program.node(name)
        lines = settings(node, types, changed=True)
        if len(lines) > SHOWN:
            lines = [*lines[: SHOWN - 1], f"... {len(lines) - SHOWN + 1} more"]
        mine = tuple(f for f in found if f.line and _node_at(program, f) == name)
        initial = name == program.initial
        kind = "" if name == END.name else node.type
        boxes.append(Box(name, kind, tuple(lines), initial, node.terminal, mine))
    arrows: dict[tuple[str, str], list[tuple[str, bool]]] = {}
    for edge in automaton.edges:
        if edge.kind != "abort":
            arrows.setdefault((edge.source, edge.target), []).append((edge.label, edge.possible))
    made = tuple(
        Arrow(a, b, tuple(label for label, _ in labels), (), not any(p for _, p in labels))
        for (a, b), labels in arrows.items()
    )
    name = program.path.replace("\\", "/").rpartition("/")[2]
    return Sketch(f"{name}: Abort leads from every node to {program.abort}", tuple(boxes), made)


def _node_at(program: Program, finding: Finding) -> str:
    """Name of the node a finding stands in: the last that begins before it in the same file."""
    before = [
        node
        for node in program.nodes.values()
        if node.line <= finding.line and (not node.file or node.file == finding.file)
    ]
    return max(before, key=lambda node: node.line).name if before else ""
