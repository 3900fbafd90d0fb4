"""What a node type declares: parameters, events, and what kind of node it makes.

Nothing here knows what a node does. The side that does (an arm, a platform) gives each type a
``make`` that turns checked parameter values into its controller.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from arm.hds.parser import KEYWORDS
from arm.hds.units import Unit, unit

ParameterValue = float | int | str
"""What a parameter holds in a checked program: SI number, integer, or word."""

_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def _check_name(what: str, name: str) -> None:
    if not _WORD.fullmatch(name) or name in KEYWORDS:
        raise ValueError(f"{what} '{name}' cannot be written in a program")


@dataclass(frozen=True)
class Parameter:
    """A parameter of a node type.

    Attributes:
        name: as written in programs, case-sensitive.
        unit: unit of a bare number, and the dimension every written unit must have.
        lo: least value [SI].
        hi: greatest value [SI].
        default: value [SI] or word when a node does not set it; None makes it required. An
            infinite default is allowed outside ``lo`` .. ``hi``: it says "never" or "no limit".
        doc: one line of documentation.
        kind: ``number``, ``integer`` or ``word``.
        choices: for ``word``, the words allowed; empty allows every word.

    Raises:
        ValueError: the declaration contradicts itself (UnitError for an unknown unit).
    """

    name: str
    unit: str = "1"
    lo: float = -math.inf
    hi: float = math.inf
    default: ParameterValue | None = None
    doc: str = ""
    kind: Literal["number", "integer", "word"] = "number"
    choices: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check_name("parameter", self.name)
        _ = self.default_unit
        if not self.lo <= self.hi:
            raise ValueError(f"parameter '{self.name}': lo {self.lo} is above hi {self.hi}")
        if self.choices and self.kind != "word":
            raise ValueError(f"parameter '{self.name}': choices are for words")
        if self.default is None:
            return
        if self.kind == "word":
            good = isinstance(self.default, str)
            good = good and (not self.choices or self.default in self.choices)
        elif isinstance(self.default, str) or math.isnan(self.default):
            good = False
        elif self.kind == "integer":
            good = float(self.default).is_integer() and self.lo <= self.default <= self.hi
        else:
            good = math.isinf(self.default) or self.lo <= self.default <= self.hi
        if not good:
            raise ValueError(f"parameter '{self.name}': default {self.default!r} is not allowed")

    @property
    def default_unit(self) -> Unit:
        """The unit a bare number has."""
        return unit(self.unit)


@dataclass(frozen=True)
class Event:
    """An event a node type can raise.

    Attributes:
        name: as written in programs, case-sensitive.
        doc: one line of documentation.
        needs: name of a parameter without which the event cannot happen: only a node that sets
            the parameter can raise it, and only then must handle it (``Timeout``).
    """

    name: str
    doc: str = ""
    needs: str | None = None

    def __post_init__(self) -> None:
        _check_name("event", self.name)

        if self.name == "Abort":
            raise ValueError("event 'Abort' is accepted in every node and cannot be declared")


@dataclass(frozen=True)
class Quantity:
    """A continuous variable guards may look at: ``TRANSITION[Force > 5 N] = Retract;``.

    Attributes:
        name: as written in programs, case-sensitive.
        unit: unit of a bare number, and the dimension every written unit must have.
        doc: one line of documentation.
    """

    name: str
    unit: str = "1"
    doc: str = ""

    def __post_init__(self) -> None:
        _check_name("quantity", self.name)
        _ = self.default_unit

    @property
    def default_unit(self) -> Unit:
        """The unit a bare number has."""
        return unit(self.unit)


TIME = Quantity("Time", "s", "Time spent in the node, interruptions not counted.")
"""What every node offers to guards, whatever its type."""


@dataclass(frozen=True)
class NodeType:
    """A type of node.

    Attributes:
        name: as written in programs, case-sensitive.
        parameters: what a node may set.
        events: what a node can raise.
        doc: what a node of this type does.
        takes_time: False if a node may raise an event in the very step it is entered. A cycle of
            such nodes would never let time pass and is refused.
        terminal: entering a node of this type ends the program.
        make: turns checked values (every parameter, SI, defaults filled in) into whatever runs
            the node; the language never calls it.
        quantities: continuous variables it offers to guards besides ``TIME``, which all offer.

    Raises:
        ValueError: the declaration contradicts itself.
    """

    name: str
    parameters: tuple[Parameter, ...] = ()
    events: tuple[Event, ...] = ()
    doc: str = ""
    takes_time: bool = True
    terminal: bool = False
    make: Callable[[Mapping[str, ParameterValue]], Any] | None = None
    quantities: tuple[Quantity, ...] = ()

    def __post_init__(self) -> None:
        _check_name("node type", self.name)
        names = [p.name for p in self.parameters]
        events = [e.name for e in self.events]
        for name in {n for n in names if names.count(n) > 1}:
            raise ValueError(f"node type '{self.name}' declares parameter '{name}' twice")
        for name in {n for n in events if events.count(n) > 1}:
            raise ValueError(f"node type '{self.name}' declares event '{name}' twice")
        quantities = [q.name for q in self.offers]
        for name in {n for n in quantities if quantities.count(n) > 1}:
            raise ValueError(f"node type '{self.name}' declares quantity '{name}' twice")
        for event in self.events:
            if event.needs is not None and event.needs not in names:
                raise ValueError(
                    f"node type '{self.name}': event '{event.name}' needs '{event.needs}', "
                    "which is no parameter"
                )

    def parameter(self, name: str) -> Parameter | None:
        """The parameter called ``name``, or None."""
        return next((p for p in self.parameters if p.name == name), None)

    def event(self, name: str) -> Event | None:
        """The event called ``name``, or None."""
        return next((e for e in self.events if e.name == name), None)

    @property
    def offers(self) -> tuple[Quantity, ...]:
        """Every quantity guards may look at in a node of this type, ``TIME`` first."""
        return (TIME, *self.quantities)

    def quantity(self, name: str) -> Quantity | None:
        """The quantity called ``name``, or None."""
        return next((q for q in self.offers if q.name == name), None)


TERMINAL = NodeType("End", doc="End the program; its name says how it ended.", terminal=True)
"""The type of a declared terminal node (``NAME = Failed; TYPE = End;``); in every registry."""

Registry = Mapping[str, NodeType]
"""Node types by name, as the checker takes them."""


def registry(*types: NodeType, quantities: tuple[Quantity, ...] = ()) -> dict[str, NodeType]:
    """Node types by their names.

    Args:
        types: the types.
        quantities: what whoever runs the nodes offers to guards in a node of any type.

    Raises:
        ValueError: two types, or two quantities of one, have the same name; one is called ``End``.
    """
    made: dict[str, NodeType] = {}
    for node_type in types:
        if node_type.name in made or node_type.name == TERMINAL.name:
            raise ValueError(f"two node types are called '{node_type.name}'")
        made[node_type.name] = replace(node_type, quantities=(*quantities, *node_type.quantities))
    return made | {TERMINAL.name: TERMINAL}
