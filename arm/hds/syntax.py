"""The syntax tree: what a program says, with the place of every piece; nothing is judged here."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Span:
    """A place in the source: line and column from 1, length in characters."""

    line: int
    column: int
    length: int


@dataclass(frozen=True)
class Name:
    """A word as written, and where; also a unit expression as written."""

    text: str
    span: Span


@dataclass(frozen=True)
class Number:
    """A number as written, with its unit if it has one; ``span`` covers the number alone."""

    text: str
    unit: Name | None
    span: Span


@dataclass(frozen=True)
class Word:
    """A plain word or, without its quotes, a quoted string; ``span`` includes the quotes."""

    text: str
    span: Span


Value = Number | Word


@dataclass(frozen=True)
class Interface:
    """``INTERFACE = name;``."""

    name: Name


@dataclass(frozen=True)
class Initial:
    """``INITIAL = node;``."""

    node: Name


@dataclass(frozen=True)
class Begin:
    """``BEGIN``."""

    span: Span


@dataclass(frozen=True)
class End:
    """``END``."""

    span: Span


@dataclass(frozen=True)
class NodeName:
    """``NAME = node;``."""

    name: Name


@dataclass(frozen=True)
class TypeName:
    """``TYPE = type;``."""

    type: Name


@dataclass(frozen=True)
class Assignment:
    """``Parameter = value;``."""

    name: Name
    value: Value


@dataclass(frozen=True)
class Transition:
    """``TRANSITION[event] = target;``."""

    event: Name
    target: Name


Statement = Interface | Initial | Begin | End | NodeName | TypeName | Assignment | Transition


@dataclass
class Block:
    """One node: everything between BEGIN and END. Lists keep duplicates for the checker.

    ``damaged`` says that statements are missing because they could not be read, so nothing may be
    concluded from what is absent.
    """

    span: Span
    names: list[Name] = field(default_factory=list)
    types: list[Name] = field(default_factory=list)
    parameters: list[Assignment] = field(default_factory=list)
    transitions: list[Transition] = field(default_factory=list)
    damaged: bool = False

    @property
    def place(self) -> Span:
        """Where findings about the node as a whole point: its name, else its BEGIN."""
        return self.names[0].span if self.names else self.span


@dataclass
class Source:
    """A whole program text. ``damaged`` as in ``Block``, for what stands outside the nodes."""

    interfaces: list[Name] = field(default_factory=list)
    initials: list[Name] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    damaged: bool = False
