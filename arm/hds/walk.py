"""Walks the discrete part of a program by typed commands, without a robot.

A command is an event, ``Force 6 N`` (sets a quantity and looks at the guards once, as a tick of
the robot does), ``tick`` (looks again), ``back``, ``restart``, ``where``, ``help`` or ``quit``.
"""

from __future__ import annotations

import math

from arm.hds.names import hint
from arm.hds.nodetype import NodeType, Registry
from arm.hds.program import ABORT, Program
from arm.hds.runtime import Automaton
from arm.hds.units import UnitError, unit

COMMANDS = ("tick", "back", "restart", "where", "help", "quit")


class Refused(ValueError):
    """A command that cannot be carried out; the text says what can."""


class Walk:
    """A program being walked through.

    Args:
        program: the checked program.
        types: the node types it was checked with; they say which quantities there are.

    Attributes:
        done: ``quit`` was typed.
    """

    def __init__(self, program: Program, types: Registry) -> None:
        self.program = program
        self.done = False
        self._types = types
        self._begin()

    def _begin(self) -> None:
        self._automaton = Automaton(self.program)
        self._automaton.start()
        self._values: dict[str, float] = {}
        self._typed: list[str] = []

    @property
    def node(self) -> str:
        """Name of the node the walk is in."""
        return self._automaton.node.name

    @property
    def ended(self) -> bool:
        """Whether that node is terminal."""
        return self._automaton.finished

    def do(self, line: str) -> str:
        """Carry out one command; returns what to show.

        Raises:
            Refused: it cannot be carried out; nothing has changed.
        """
        words = line.split(maxsplit=1)
        if not words:
            return self.where()
        match words[0].lower() if len(words) == 1 else "":
            case "where":
                return self.where()
            case "help":
                return "events, quantities and " + ", ".join(COMMANDS) + "; see where"
            case "quit":
                self.done = True
                return ""
            case "restart":
                self._begin()
                return self.where()
            case "back":
                return self._back()
        said = self._step(words)
        self._typed.append(line)
        return said

    def where(self) -> str:
        """The node, its events, its guards, and what is set."""
        node = self._automaton.node
        count = self._automaton.transitions
        plural = "" if count == 1 else "s"
        lines = [f"{node.name} ({node.type}), after {count} transition{plural}"]
        if node.terminal:
            return lines[0] + "\n  the program has ended; back, restart or quit"
        lines += [f"  {event} -> {target}" for event, target in node.transitions.items()]
        for guard in node.guards:
            value = self._values.get(guard.quantity)
            holds = value is not None and guard.holds(value)
            lines.append(f"  {guard.text} -> {guard.target}{'   (holds now)' if holds else ''}")
        lines.append(f"  {ABORT} -> {self.program.abort}")
        if any(guard.holds(self._values.get(guard.quantity, math.nan)) for guard in node.guards):
            lines.append("  unless an event comes first, the next tick takes what holds: tick")
        return "\n".join(lines)

    def _step(self, words: list[str]) -> str:
        before, automaton = self.node, self._automaton
        if automaton.finished:
            raise Refused(f"the program ended in '{before}'; back, restart or quit")
        if words == ["tick"]:
            return self._look(before)
        if len(words) == 2:
            name, value = self._quantity(words[0], words[1])
            self._values[name] = value
            return self._look(before)
        event = words[0]
        if event != ABORT and event not in automaton.node.transitions:
            valid = [*automaton.node.transitions, ABORT]
            quantity = next((q.name for q in self._kind.offers if q.name == event), None)
            if quantity is not None:
                raise Refused(f"'{event}' is a quantity: give its value, as in {event} 6")
            text = f"node '{before}' does not handle '{event}'"
            raise Refused(f"{text}; {hint(event, valid, 'valid events')}")
        automaton.fire(event)
        return self._moved(before, event)

    def _look(self, before: str) -> str:
        """One tick: take the first guard that holds."""
        names = {guard.quantity for guard in self._automaton.guards}
        values = {name: self._values.get(name, math.nan) for name in names}
        taken = self._automaton.check_guards(values)
        if taken is None:
            return f"no guard of {before} holds"
        return self._moved(before, self._automaton.history[-1].event)

    def _moved(self, before: str, label: str) -> str:
        self._values.pop("Time", None)  # counts from the entry of each node
        return f"{before} -[{label}]-> {self.where()}"

    @property
    def _kind(self) -> NodeType:
        return self._types[self._automaton.node.type]

    def _quantity(self, name: str, text: str) -> tuple[str, float]:
        """Name and SI value of ``force 6 N``; upper and lower case do not matter."""
        offers = self._kind.offers
        quantity = next((q for q in offers if q.name.lower() == name.lower()), None)
        if quantity is None:
            valid = hint(name, [q.name for q in offers], "valid quantities")
            raise Refused(f"node '{self.node}' offers no quantity '{name}'; {valid}")
        wanted = quantity.default_unit
        number, _, written = text.strip().lstrip("=").strip().partition(" ")
        try:
            used = unit(written) if written.strip() else wanted
            value = used.to_si(number)
        except UnitError as error:
            raise Refused(f"{error}; '{quantity.name}' is given in {wanted.name}") from None
        except ValueError:
            text = f"'{number}' is not a number"
            raise Refused(f"{text}; write {quantity.name} 6 {wanted.name}") from None
        if used.dimension != wanted.dimension:
            raise Refused(f"'{quantity.name}' is given in {wanted.name}, not in {written}")
        return quantity.name, value

    def _back(self) -> str:
        if not self._typed:
            raise Refused("this is the start; nothing to go back to")
        typed = self._typed[:-1]
        self._begin()
        for line in typed:
            self.do(line)
        return self.where()


def split_events(text: str) -> list[str]:
    """Commands from ``a, b, Force 6 N``: separated by commas, semicolons or line ends."""
    for separator in ",;":
        text = text.replace(separator, "\n")
    return [line.strip() for line in text.splitlines() if line.strip()]
