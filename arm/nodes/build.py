"""Makes what runs a node, and finds the files a program speaks of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from arm.hds import Finding, Node, NodeType, ParameterValue, Program
from arm.hds.syntax import Span
from arm.nodes.node import Control

PROGRAMS = Path(__file__).parent.parent / "programs"

FILE = "File"
"""A word parameter of this name is a file, beside where it is written or in arm/programs."""


def make_control(
    kind: NodeType, values: Mapping[str, ParameterValue], beside: Path | None = None
) -> Control:
    """The control of a node type, its file found.

    Args:
        kind: with a ``make``.
        values: every parameter [SI].
        beside: folder that relative files start from.

    Raises:
        ValueError: the file is not there or cannot be used, or the values contradict each other.
    """
    assert kind.make is not None
    if FILE in values:
        values = {**values, FILE: str(find_file(str(values[FILE]), beside))}
    control: Control = kind.make(values)
    return control


def find_file(name: str, beside: Path | None) -> Path:
    """A file a program names.

    Raises:
        ValueError: it is in neither place; both are named.
    """
    folders = [PROGRAMS] if beside is None else [beside, PROGRAMS]
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    places = " or ".join(str(folder) for folder in folders)
    raise ValueError(f"there is no file {name!r} in {places}")


def builder(types: Mapping[str, NodeType]) -> Callable[[Node, Program], Any]:
    """What makes the control of a node, by such types: ``build_from`` of them."""
    return partial(build_from, types)


def build_from(types: Mapping[str, NodeType], node: Node, program: Program) -> Any:
    """The control of a program's node, as its type makes it.

    Raises:
        ValueError: it cannot be made; the text names the node.
    """
    try:
        written = node.places.get(FILE)
        file = program.path if written is None else written.file
        beside = Path(file).resolve().parent
        return make_control(types[node.type], node.parameters, beside)
    except ValueError as error:
        raise ValueError(f"node {node.name}: {error}") from None


def unusable(types: Mapping[str, NodeType], program: Program) -> list[Finding]:
    """What is wrong with a checked program that only shows when its nodes are made.

    Findings point at the value of ``File`` where a node has one, else at the node's BEGIN.
    """
    found = []
    for node in program.nodes.values():
        try:
            if not node.terminal:
                build_from(types, node, program)
        except ValueError as error:
            at = node.places.get(FILE, Span(node.line, 1, 0, node.file))
            source = _line(at)
            where = (at.file, at.line, at.column, at.length)
            found.append(Finding("error", "unusable", str(error), *where, source=source))
    return found


def _line(place: Span) -> str:
    """The source line of a place; empty if the program has no file."""
    try:
        lines = Path(place.file).read_text(encoding="utf-8").split("\n")
    except OSError:
        return ""
    return lines[place.line - 1].rstrip("\r") if place.line <= len(lines) else ""
