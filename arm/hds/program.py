"""A checked program: what the runtime runs."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from arm.hds.finding import Finding
from arm.hds.nodetype import ParameterValue
from arm.hds.syntax import Span

Operator = Literal[">", "<", ">=", "<="]
"""What a guard compares with."""

_COMPARE: dict[str, Callable[[float, float], bool]] = {
    ">": operator.gt,
    "<": operator.lt,
    ">=": operator.ge,
    "<=": operator.le,
}


@dataclass(frozen=True)
class Guard:
    """A transition on a continuous variable: ``TRANSITION[Force > 5 N] = Retract;``.

    Attributes:
        quantity: name of the quantity, one the node's type offers.
        operator: ``>``, ``<``, ``>=`` or ``<=``.
        limit: what it is compared with [SI].
        target: name of the next node.
        text: the condition for people, in one spelling: ``Force > 5 N``.
        file: source it stands in; with ``LIKE``, where it was taken from.
        line: line of the quantity's name there, from 1.
        column: and its column, from 1.
    """

    quantity: str
    operator: Operator
    limit: float
    target: str
    text: str = ""
    file: str = ""
    line: int = 0
    column: int = 0

    def holds(self, value: float) -> bool:
        """Whether it holds for a value [SI]; not for one that is not a number."""
        return _COMPARE[self.operator](value, self.limit)


@dataclass(frozen=True)
class Node:
    """One node of a program.

    Attributes:
        name: its name.
        type: name of its node type.
        parameters: every parameter of the type: SI number, integer or word; defaults filled in.
        transitions: event to name of the next node; ``Abort`` is not among them.
        terminal: whether the program ends on entering it.
        line: line of its BEGIN in the source; 0 for the predefined ``End``.
        guards: transitions on continuous variables, in the order they are looked at.
        file: source it stands in; empty for the predefined ``End``.
        like: name of the node it was taken over from with ``LIKE``, or empty; everything taken
            over is already in the other attributes.
        places: where the value of each parameter that is set stands, with ``LIKE`` where it was
            taken from, for a constant in its declaration; ``file`` is never empty.
    """

    name: str
    type: str
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)
    transitions: Mapping[str, str] = field(default_factory=dict)
    terminal: bool = False
    line: int = 0
    guards: tuple[Guard, ...] = ()
    file: str = ""
    like: str = ""
    places: Mapping[str, Span] = field(default_factory=dict, compare=False)


END = Node("End", "End", terminal=True)
"""The predefined terminal node; a program goes there without declaring it."""

ABORT = "Abort"
"""The event that is accepted in every node and leads to ``Program.abort``."""


@dataclass(frozen=True)
class Constant:
    """A named value: ``CONSTANT Pressure = 150 cN;``.

    Attributes:
        name: its name.
        text: its value as written, with its unit if it has one.
        file: source it stands in.
        line: line of its name there, from 1.
        column: and its column, from 1.
    """

    name: str
    text: str
    file: str = ""
    line: int = 0
    column: int = 0


@dataclass(frozen=True)
class Program:
    """A program without errors.

    Attributes:
        nodes: declared nodes by name, in the order of the source, included files first.
        initial: name of the node that runs first.
        interface: the robot interface the program is for.
        path: where the source came from, as given to the checker.
        sha256: digest of the source text in UTF-8, for recordings and trial results; with
            included files, of the digests of all texts.
        warnings: what the checker found that is no error.
        constants: named constants by name; values in nodes already hold what they stand for.
        abort: name of the node the program goes to from every node on the event ``Abort``.
        includes: included files as findings name them, in the order they were read.
    """

    nodes: Mapping[str, Node]
    initial: str
    interface: str
    path: str
    sha256: str
    warnings: tuple[Finding, ...] = ()
    constants: Mapping[str, Constant] = field(default_factory=dict)
    abort: str = END.name
    includes: tuple[str, ...] = ()

    def node(self, name: str) -> Node:
        """The node called ``name``, ``End`` included.

        Raises:
            KeyError: there is none.
        """
        return END if name == END.name else self.nodes[name]
