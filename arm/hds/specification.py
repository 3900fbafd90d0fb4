"""Specifications: small automata over what happens in a program, with a predefined ``Forbidden``.

``TRANSITION[Whiteboard_line] = Forbidden;`` in a state says that no node of that type may be
entered while the specification is in that state (docs/language.md, "Specifications").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

FORBIDDEN = "Forbidden"
"""The predefined state that must never be reached."""

ENTERED = "Entered"
"""What ``Node.Entered`` calls the entering of a node; the bare name of the node means the same."""


@dataclass(frozen=True)
class Happening:
    """One part of a step of the program: something is raised in a node, or a node is entered.

    Attributes:
        name: the event, the guard's quantity, ``Abort``, or ``Entered``.
        node: where.
        type: the node's type.
    """

    name: str
    node: str
    type: str


@dataclass(frozen=True)
class Symbol:
    """What a rule looks for: ``Contact``, ``Line1``, ``Line1.Finished``, ``Whiteboard_line``.

    Attributes:
        place: name of a node or of a node type; empty for any.
        name: what is raised there; ``Entered`` for entering it.
    """

    place: str
    name: str

    def matches(self, happening: Happening) -> bool:
        """Whether this is what happens."""
        there = not self.place or self.place in (happening.node, happening.type)
        return there and self.name == happening.name

    def __str__(self) -> str:
        if self.name == ENTERED:
            return self.place
        return f"{self.place}.{self.name}" if self.place else self.name


@dataclass(frozen=True)
class Rule:
    """``TRANSITION[symbol, ...] = target;`` on a line of the file."""

    symbols: tuple[Symbol, ...]
    target: str
    line: int


@dataclass(frozen=True)
class Specification:
    """A specification without errors.

    Attributes:
        states: rules of each state, in the order of the file.
        initial: the first state.
        path: where it came from.
    """

    states: Mapping[str, tuple[Rule, ...]]
    initial: str
    path: str = ""

    def step(self, state: str, happening: Happening) -> tuple[str, Rule | None]:
        """The state after something happened, and the rule that said so.

        The first rule that matches counts; without one the state stays.
        """
        for rule in self.states[state]:
            if any(symbol.matches(happening) for symbol in rule.symbols):
                return rule.target, rule
        return state, None
