"""What every executive shares: its safe states, its program, and what people may ask of it.

A request raises ValueError with the reason when it cannot be granted. What an arm does about a
change (let go, hold, come back) is its own; the order of the states is ``arm_states.hds``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from arm.hds import ABORT, Automaton, Node, Program, Step
from arm.safe_states import arm_states

LATE, ON_TIME = 0.025, 0.015
"""An estimate older than this is late, younger than this on time again [s]."""


class ProgramRunner:
    """Safe states and program of an executive; the arms themselves are the subclass'.

    Args:
        who: for texts, "the arm is".
        build: the control of a node of a program; ValueError if it cannot be made.

    Attributes:
        states: the machine of the safe states.
    """

    def __init__(self, who: str, build: Callable[[Node, Program], Any]) -> None:
        self.states = arm_states(who, self._told)
        self._build = build
        self._automaton: Automaton | None = None
        self._event = self._note = ""
        self._start_node = False
        self._changed = False

    # --- what an arm does about it ------------------------------------------------------------

    def _problem(self) -> str:
        """Why no program can go on now; empty if one can."""
        raise NotImplementedError

    def _halt(self, keep_place: bool) -> None:
        """The program is interrupted: make the arm safe, remember what is needed to come back."""
        raise NotImplementedError

    def _drop(self, stopped: bool) -> None:
        """The program is given up, or ended by an abort: make the arm safe, forget the way back.

        Args:
            stopped: by a protective stop.
        """
        raise NotImplementedError

    def _come_back(self) -> None:
        """Resume: fire ``Resume`` after a way back has begun, or ``Enter``."""
        self._start_node = True
        self.states.fire("Enter")

    def _redirected(self, target: str) -> None:
        """Raise ValueError if the interrupted program must not go on in a node."""

    # --- requests -------------------------------------------------------------------------------

    def start(self, program: Program) -> None:
        """Run a checked program from its initial node.

        Raises:
            ValueError: a program is running or interrupted, the arm is stopped, there is no valid
                estimate, or a node cannot be made of its parameters.
        """
        self.states.require("Start")
        if self._problem():
            raise ValueError(f"no valid estimate yet: {self._problem()}")
        for node in program.nodes.values():
            if not node.terminal:  # what cannot be made is refused before anything moves
                self._build(node, program)
        self._automaton = Automaton(program)
        self._automaton.start()
        self._tell("start")
        self.states.fire("Start")
        self._start_node = True

    def pause(self) -> None:
        """Stop the program where it is and wait.

        Raises:
            ValueError: no program is running.
        """
        self.states.require("Pause", "no program is running")
        self._interrupt("Pause", "asked to pause", keep_place=True)

    def resume(self) -> None:
        """Go on where the program was interrupted.

        Raises:
            ValueError: nothing to resume, or the cause of the interruption is still there.
        """
        self.states.require("Resume", "nothing to resume")
        if self._problem():
            raise ValueError(f"cannot resume yet: {self._problem()}")
        if self._automaton is None:
            self.states.fire("Stop")
            return
        self._tell("resume")
        self._come_back()

    def jump(self, node: str) -> None:
        """Let an interrupted program go on in another of its nodes once it is resumed.

        Nothing moves before; the node is entered anew.

        Raises:
            ValueError: the program is not interrupted, has no such node, or must not go on there.
        """
        automaton = self._halted()
        if node not in automaton.program.nodes:
            known = ", ".join(automaton.program.nodes)
            raise ValueError(f"there is no node {node!r} to jump to; there are: {known}")
        self._redirected(node)
        automaton.reset(node)
        self._goes_on("jump")

    def follow(self, event: str) -> None:
        """Let an interrupted program go on, once resumed, as if its node had raised an event.

        Raises:
            ValueError: as for ``jump``, or the node does not handle the event.
        """
        automaton = self._halted()
        node = automaton.node
        targets = {} if node.terminal else {**node.transitions, ABORT: automaton.program.abort}
        if event not in targets:
            known = ", ".join(targets) or "none"
            raise ValueError(f"{node.name} does not handle {event!r}; it handles: {known}")
        self._redirected(targets[event])
        automaton.fire(event)
        self._goes_on(event)

    def stop(self) -> None:
        """Give the program up and hold still.

        Raises:
            ValueError: the arm is in protective stop.
        """
        self.states.require("Stop")
        self._start_node = False
        self._drop(stopped=False)
        self._automaton = None
        self.states.fire("Stop", "stopped by request")

    def abort(self) -> None:
        """Go to the program's abort node, from whatever node it is in or was interrupted in.

        Raises:
            ValueError: no program is running or interrupted, or there is no valid estimate.
        """
        self.states.require("Give_up", "no program to abort")
        if self._automaton is None:
            raise ValueError("no program to abort: it was never begun")
        if self._problem():
            raise ValueError(f"cannot go on yet: {self._problem()}; stop instead")
        self._automaton.fire(ABORT)
        self._tell(ABORT)
        if self._automaton.finished:
            self._start_node = False
            self._drop(stopped=False)
            self.states.fire("Done", "aborted")
            return
        self._forget_way_back()
        self._start_node = True
        self.states.fire("Give_up")

    def protective_stop(self, reason: str) -> None:
        """Stop now; only ``reset`` leads out."""
        if self.state == "protective_stop":
            return
        self._start_node = False
        self._drop(stopped=True)
        self._automaton = None
        self.states.abort(reason)

    def reset(self) -> None:
        """Leave a protective stop, once a person has looked.

        Raises:
            ValueError: the arm is not stopped.
        """
        self.states.require("Reset", "not in protective stop")
        self.states.fire("Reset")

    # --- for the subclass -------------------------------------------------------------------------

    @property
    def state(self) -> str:
        """Name of the safe state, as on the status topic."""
        return self.states.state

    @property
    def reason(self) -> str:
        """Why it is in its state; empty if nothing is to be said."""
        return self.states.reason

    @property
    def _working(self) -> bool:
        """Whether the program has the arm."""
        return self.states.type == "Work"

    @property
    def _halting(self) -> bool:
        """Whether a program is interrupted."""
        return self.states.type == "Halt"

    def _forget_way_back(self) -> None:
        """An abort leads on from here: there is no way back any more."""

    def _interrupt(self, event: str, reason: str, keep_place: bool = False) -> None:
        """Stop the program where it is, so that it can be resumed."""
        self._start_node = False
        self._halt(keep_place)
        self.states.fire(event, reason)

    def _look_at_age(self, age: float) -> None:
        """Run degraded while what the program goes by is older than it should be [s]."""
        if self.state == "running" and age > LATE:
            self.states.fire("Late", f"slower: the estimate is {1000 * age:.0f} ms old")
        elif self.state == "degraded" and age < ON_TIME:
            self.states.fire("On_time")

    def _halted(self) -> Automaton:
        """The interrupted program."""
        if not self._halting or self._automaton is None:
            raise ValueError(f"{self.states}; pause its program first")
        return self._automaton

    def _goes_on(self, event: str) -> None:
        assert self._automaton is not None
        self._tell(event)
        self.states.reason = f"goes on in {self._automaton.node.name}"
        self._changed = True

    def _tell(self, event: str, reason: str = "") -> None:
        """The newest event, and why it was raised where its name does not say it all."""
        self._event, self._note = event, reason

    def _told(self, step: Step, reason: str) -> None:
        self._changed = True
