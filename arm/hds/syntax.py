"""The syntax tree: what a program says, with the place of every piece; nothing is judged here."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Span:
    """A place in the source: line and column from 1, length in characters.

    ``file`` names an included file as findings do; it is empty for the program's own text.
    """

    line: int
    column: int
    length: int
    file: str = ""


@dataclass(frozen=True)
class Name:
    """A word as written, and where; also a unit expression as written."""

    text: str
    span: Span


@dataclass(frozen=True)
class Number:
    """A number as written, with its unit if it has one; ``span`` covers the number alone.

    ``constant`` names the constant it came from; the places are then those of the name.
    """

    text: str
    unit: Name | None
    span: Span
    constant: str = ""


@dataclass(frozen=True)
class Word:
    """A plain word or, without its quotes, a quoted string; ``span`` includes the quotes."""

    text: str
    span: Span
    quoted: bool = False


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
class Abort:
    """``ABORT = node;``."""

    node: Name


@dataclass(frozen=True)
class Constant:
    """``CONSTANT name = value;``."""

    name: Name
    value: Value


@dataclass(frozen=True)
class Include:
    """``INCLUDE "file";``."""

    path: Name


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
class Like:
    """``LIKE = node;``."""

    node: Name


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


@dataclass(frozen=True)
class Guarded:
    """``TRANSITION[quantity > limit] = target;``."""

    quantity: Name
    operator: str
    limit: Value
    target: Name


Header = Interface | Initial | Abort | Constant | Include
Statement = Header | Begin | End | NodeName | TypeName | Like | Assignment | Transition | Guarded


@dataclass
class Block:
    """One node: everything between BEGIN and END. Lists keep duplicates for the checker.

    ``damaged`` says that statements are missing because they could not be read, so nothing may be
    concluded from what is absent.
    """

    span: Span
    names: list[Name] = field(default_factory=list)
    types: list[Name] = field(default_factory=list)
    likes: list[Name] = field(default_factory=list)
    parameters: list[Assignment] = field(default_factory=list)
    transitions: list[Transition] = field(default_factory=list)
    guards: list[Guarded] = field(default_factory=list)
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
    aborts: list[Name] = field(default_factory=list)
    constants: list[Constant] = field(default_factory=list)
    includes: list[Name] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    damaged: bool = False
