"""Makes what runs a node, and finds and checks the programs of the platform."""

from __future__ import annotations

from pathlib import Path

from arm.hds import Finding, Node, Program, ProgramError, load
from base.nodes import REGISTRY, Control
from deploy.task import BASE_PROGRAMS, find_program
from deploy.tomlfile import BadFile

INTERFACE = "platform"
"""What the header of a program of the platform says."""


def build(node: Node) -> Control:
    """The control of a program's node, which is not terminal."""
    kind = REGISTRY[node.type]
    assert kind.make is not None
    control: Control = kind.make(node.parameters)
    return control


def unusable(program: Program) -> list[Finding]:
    """What is wrong with a checked program beyond its language: that it is none of ours."""
    if program.interface == INTERFACE:
        return []
    return [Finding("error", "unusable", not_ours(program), program.path, 1, 1, 0)]


def not_ours(program: Program) -> str:
    """That a program is for somebody else, in words."""
    return f"INTERFACE is {program.interface}; a program of the platform says {INTERFACE}"


def load_program(name: str, beside: Path | None = None) -> Program:
    """A checked program by its name in base/programs, or by path.

    Args:
        name: with or without ``.hds``.
        beside: folder that relative paths start from.

    Raises:
        ValueError: there is none of that name (the known ones are listed), it cannot be read, has
            errors (all of them are listed), or is for somebody else.
    """
    try:
        program = load(find_program(name, beside, (BASE_PROGRAMS,), "task.base.program"), REGISTRY)
    except BadFile as error:
        raise ValueError("; ".join(error.findings)) from None
    except (ProgramError, OSError) as error:
        raise ValueError(str(error)) from None
    if program.interface != INTERFACE:
        raise ValueError(f"{name}: {not_ours(program)}")
    return program
