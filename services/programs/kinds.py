"""Whose program a file is: each of arm and platform has node types of its own."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from arm.hds import Finding, Program, Registry

OWNERS = (
    *("arm", "two_arms", "hand", "platform"),
    *("arm_states", "platform_states", "service_states"),
)

_INTERFACE = re.compile(r"^\s*INTERFACE\s*=\s*(\w+)", re.MULTILINE)


@dataclass(frozen=True)
class Kind:
    """What programs of an owner are made of.

    Attributes:
        owner: one of ``OWNERS``.
        registry: node types by name.
        unusable: what is wrong with a checked program beyond its language.
    """

    owner: str
    registry: Registry
    unusable: Callable[[Program], list[Finding]]


def kind_of(file: Path) -> Kind:
    """The kind of a program: of the owner in its header, ``INTERFACE = platform;``, else the arm's.

    A file that cannot be read is the arm's: whoever reads it next says what is wrong.
    """
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        text = ""
    found = _INTERFACE.search(text)
    return kind(found[1] if found is not None and found[1] in OWNERS else "arm")


def kind(owner: str) -> Kind:
    """The kind of an owner's programs.

    Raises:
        ValueError: no such owner; the known ones are named.
    """
    if owner == "arm":
        from arm.nodes import REGISTRY
        from arm.nodes.build import unusable

        return Kind(owner, REGISTRY, lambda program: unusable(REGISTRY, program))
    if owner == "two_arms":
        from arm.grasping.nodes import REGISTRY as GRASPING
        from arm.nodes.build import unusable

        return Kind(owner, GRASPING, lambda program: unusable(GRASPING, program))
    if owner == "arm_states":
        from arm.safe_states import STATES

        return Kind(owner, STATES, lambda program: [])
    if owner == "platform_states":
        from base.safe_states import STATES as PLATFORM_STATES

        return Kind(owner, PLATFORM_STATES, lambda program: [])
    if owner == "service_states":
        from services.live.service_states import STATES as SERVICE_STATES

        return Kind(owner, SERVICE_STATES, lambda program: [])
    if owner == "hand":
        from arm.hand.nodes import REGISTRY as HANDLING
        from arm.nodes.build import unusable

        return Kind(owner, HANDLING, lambda program: unusable(HANDLING, program))
    if owner == "platform":
        from base.nodes import REGISTRY as TYPES
        from base.nodes import build

        return Kind(owner, TYPES, build.unusable)
    raise ValueError(f"nobody called {owner!r} has programs. Known: {', '.join(OWNERS)}")


def find(name: Path) -> Path:
    """The file of a program given as a file or by name, in arm/programs or base/programs.

    Raises:
        BadFile: there is none; the known ones are named.
    """
    if name.is_file():
        return name
    from deploy.task import BASE_PROGRAMS, PROGRAMS, find_program  # takes a while to import

    return find_program(str(name), None, (PROGRAMS, BASE_PROGRAMS), "")
