"""Makes what runs a node, and finds the files a program speaks of."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from arm.hds import Finding, Node, NodeType, ParameterValue, Program
from arm.nodes.node import Control

PROGRAMS = Path(__file__).parent.parent / "programs"

FILE = "File"
"""A word parameter of this name is a file, beside the program or in arm/programs."""


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


def build_from(types: Mapping[str, NodeType], node: Node, program: Program) -> Control:
    """The control of a program's node.

    Raises:
        ValueError: it cannot be made; the text names the node.
    """
    try:
        beside = Path(program.path).resolve().parent
        return make_control(types[node.type], node.parameters, beside)
    except ValueError as error:
        raise ValueError(f"node {node.name}: {error}") from None


def unusable(types: Mapping[str, NodeType], program: Program) -> list[Finding]:
    """What is wrong with a checked program that only shows when its nodes are made."""
    found = []
    for node in program.nodes.values():
        try:
            if not node.terminal:
                build_from(types, node, program)
        except ValueError as error:
            text = str(error)
            found.append(Finding("error", "unusable", text, program.path, node.line, 1, 0))
    return found
