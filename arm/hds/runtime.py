"""The discrete part of H = (Q, X, I, f, E, G, T): which node runs, and where an event leads.

The continuous part is the caller's: it runs the current node's controller, fires the events that
controller raises, and once a tick hands over the values guards look at. Nothing here knows of time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

from arm.hds.names import hint
from arm.hds.program import ABORT, Guard, Node, Program


class AutomatonError(RuntimeError):
    """The automaton cannot do what was asked; the text says what it can."""


class UnhandledEvent(AutomatonError):
    """An event the current node does not handle."""


class UnknownNode(AutomatonError):
    """A node the program does not have."""


@dataclass(frozen=True)
class Step:
    """One change of node.

    ``source`` is None for a start or reset, ``event`` then says which; for a guard ``event`` is
    the guard's text (``Force > 5 N``).
    """

    event: str
    source: str | None
    target: str


class Automaton:
    """Runs a program's transitions.

    Args:
        program: the checked program.
        keep: how many steps ``history`` keeps; a policy may run for days.
    """

    def __init__(self, program: Program, keep: int = 1000) -> None:
        self.program = program
        self._node: Node | None = None
        self._transitions = 0
        self._history: deque[Step] = deque(maxlen=keep)

    @property
    def node(self) -> Node:
        """The current node; ``END`` after the predefined end was reached.

        Raises:
            AutomatonError: not started.
        """
        if self._node is None:
            raise AutomatonError("the automaton is not started; call start() first")
        return self._node

    @property
    def started(self) -> bool:
        """Whether ``start`` or ``reset`` has been called."""
        return self._node is not None

    @property
    def finished(self) -> bool:
        """Whether the current node is terminal: ``END`` or a declared terminal node."""
        return self._node is not None and self._node.terminal

    @property
    def events(self) -> tuple[str, ...]:
        """The events the current node handles besides ``Abort``; none before the start, and none
        after the end."""
        return () if self._node is None or self.finished else tuple(self._node.transitions)

    @property
    def guards(self) -> tuple[Guard, ...]:
        """The guards of the current node; none before the start and after the end."""
        return () if self._node is None or self.finished else self._node.guards

    @property
    def transitions(self) -> int:
        """Events and guards fired since ``start``."""
        return self._transitions

    @property
    def history(self) -> tuple[Step, ...]:
        """Starts, resets and transitions since ``start``, oldest first, the last ``keep``."""
        return tuple(self._history)

    def start(self) -> Node:
        """Go to the initial node, from wherever, and forget what was; returns that node."""
        self._transitions = 0
        self._history.clear()
        return self._enter("start", self.program.initial)

    def reset(self, node_name: str) -> Node:
        """Resume at a declared node, keeping count and history; returns that node.

        Raises:
            UnknownNode: the program has no such node; the text lists those it has.
        """
        if node_name not in self.program.nodes:
            help = hint(node_name, self.program.nodes, "valid nodes")
            raise UnknownNode(f"there is no node '{node_name}' to resume at; {help}")
        return self._enter("reset", node_name)

    def fire(self, event: str) -> Node:
        """Follow the current node's transition for an event; returns the node it leads to.

        ``Abort`` leads from every node to the program's abort node, from that node to itself.

        Raises:
            UnhandledEvent: the node does not handle the event; the text lists those it does.
            AutomatonError: not started, or finished.
        """
        node = self.node
        if node.terminal:
            raise AutomatonError(f"the program ended in '{node.name}'; '{event}' leads nowhere")
        target = self.program.abort if event == ABORT else node.transitions.get(event)
        if target is None:
            help = hint(event, node.transitions, "valid events")
            raise UnhandledEvent(f"node '{node.name}' does not handle '{event}'; {help}")
        self._transitions += 1
        return self._enter(event, target, node.name)

    def check_guards(self, values: Mapping[str, float]) -> Node | None:
        """Follow the current node's first guard, in textual order, that holds.

        Guards look at levels, not at edges: one that holds already when its node is entered fires
        at the first look. So that time passes in every node, look once a tick, after the events,
        and not in the tick in which the node was entered. No guard holds for NaN.

        Args:
            values: the quantities' values now [SI]; at least those the node's guards look at.

        Returns:
            The node it leads to; None if no guard holds.

        Raises:
            AutomatonError: a value is missing, or not started.
        """
        node = self.node
        for guard in () if node.terminal else node.guards:
            value = values.get(guard.quantity)
            if value is None:
                raise AutomatonError(
                    f"the guard '{guard.text}' of node '{node.name}' needs the value of "
                    f"'{guard.quantity}'; given: {', '.join(values) or 'none'}"
                )
            if guard.holds(value):
                self._transitions += 1
                return self._enter(guard.text, guard.target, node.name)
        return None

    def _enter(self, event: str, target: str, source: str | None = None) -> Node:
        self._history.append(Step(event, source, target))
        self._node = self.program.node(target)
        return self._node
