"""Safe states: what may happen to something that can fail, in each state, and where that leads.

The states are a program in our own language, checked before it is used: a node is a state, and the
type of the node says which events the state must have an answer to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from arm.hds.check import load
from arm.hds.nodetype import Registry
from arm.hds.program import ABORT
from arm.hds.runtime import Automaton, Step


class Machine:
    """A state with the reason for it, changed by events alone.

    Args:
        program: file of the automaton, with node types of ``registry``.
        registry: node types by name.
        who: for texts, "the arm is".
        requests: events people ask for, and the verb they ask with.
        told: called with every change of state and its reason.

    Attributes:
        reason: why it is in its state; empty if nothing is to be said.

    Raises:
        ProgramError: the automaton has an error; all findings are in it.
    """

    def __init__(
        self,
        program: Path,
        registry: Registry,
        who: str,
        requests: Mapping[str, str],
        told: Callable[[Step, str], None] | None = None,
    ) -> None:
        self._automaton = Automaton(load(program, registry))
        self._automaton.start()
        self._who, self._requests = who, requests
        self._told = told
        self.reason = ""

    @property
    def state(self) -> str:
        """Name of the state in lower case, as on the status topics."""
        return self._automaton.node.name.lower()

    @property
    def type(self) -> str:
        """Type of the state: what its events are."""
        return self._automaton.node.type

    @property
    def history(self) -> tuple[Step, ...]:
        """The last changes, oldest first."""
        return self._automaton.history

    def can(self, event: str) -> bool:
        """Whether the state has an answer to an event."""
        return event in self._automaton.events

    def require(self, event: str, otherwise: str = "") -> None:
        """Do nothing if an event is possible now.

        Args:
            event: it.
            otherwise: what could not be done, first in the text of the error.

        Raises:
            ValueError: it is not; the text names the state, its reason and what is possible.
        """
        if not self.can(event):
            verbs = (verb for name, verb in self._requests.items() if self.can(name))
            start = f"{otherwise}: " if otherwise else ""
            raise ValueError(f"{start}{self}; possible now: {', '.join(verbs)}")

    def fire(self, event: str, reason: str = "") -> None:
        """Follow an event.

        Raises:
            UnhandledEvent: the state has no answer to it; ``can`` tells.
        """
        self._automaton.fire(event)
        self.reason = reason
        if self._told is not None:
            self._told(self._automaton.history[-1], reason)

    def abort(self, reason: str) -> None:
        """Go where the automaton's ABORT leads, which every state does."""
        self.fire(ABORT, reason)

    def __str__(self) -> str:
        return f"{self._who} {self.state}" + (f" ({self.reason})" if self.reason else "")
