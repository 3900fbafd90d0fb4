"""Steps the nodes of a program whose steps say an event, its reason and a goal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any, Protocol

import numpy as np

from arm.program_runner import ProgramRunner
from services.messages import ArmStatus, Array

STATUS_PERIOD = 0.02
"""[s]"""


class Timed(Protocol):
    """What a node sees at one tick."""

    dt: float


class NodeRunner(ProgramRunner):
    """Runs the current node, follows its events and guards, and tells of it."""

    def __init__(self, who: str, build: Any, step: Any) -> None:
        super().__init__(who, build)
        self._node: Any = None
        self._step = step
        self._note = ""
        self._cause = ""  # of the newest event that had one: why a program ended as it did
        self._in_node = 0.0
        self._new_node = False
        self._goals = 0
        self._status_due = 0.0

    # --- what an arm does about it ------------------------------------------------------------

    def _advance(self, scene: Any) -> Any:
        """The current node's next step; None if it was interrupted instead."""
        raise NotImplementedError

    def _enter(self, scene: Any) -> None:
        """Enter the node that was just made, or interrupt the program."""
        raise NotImplementedError

    def _end(self, scene: Any) -> None:
        """The program has ended: make the arm safe."""
        raise NotImplementedError

    def _values(self, scene: Any) -> Mapping[str, float]:
        """What guards look at."""
        raise NotImplementedError

    # --- the program ----------------------------------------------------------------------------

    def _run(self, scene: Timed) -> None:
        """Step the node, follow its events and guards."""
        self._new_node = False
        if self._start_node:
            self._start_node = False
            self._next_node(scene)
        if self._node is None:
            return
        self._update(scene)
        if self._guarded(scene):
            self._update(scene)
        # what follows takes over within this tick; the language refuses cycles that take no time
        while self._step.event is not None and self._working:
            assert self._automaton is not None
            self._event, self._note = self._step.event, self._step.reason
            self._cause = self._step.reason or self._cause
            self._automaton.fire(self._step.event)
            self._next_node(scene)
            if self._working:
                self._update(scene)

    def _update(self, scene: Timed) -> None:
        before = self._step.goal
        step = self._advance(scene)
        if step is None:
            return
        self._step = step
        if step.goal is None:
            self._changed |= before is not None
        elif before is None or (step.goal != before).any():
            self._goals += 1
            self._changed = True

    def _guarded(self, scene: Timed) -> bool:
        """Follow a guard that holds, unless the node is new or has raised an event."""
        automaton = self._automaton
        if not self._working or automaton is None or self._new_node:
            return False
        self._in_node += scene.dt
        if self._step.event is not None or not automaton.guards:
            return False
        if automaton.check_guards(self._values(scene)) is None:
            return False
        self._event, self._note = automaton.history[-1].event, ""
        self._next_node(scene)
        return self._working

    def _next_node(self, scene: Timed) -> None:
        """Enter the automaton's current node."""
        assert self._automaton is not None
        self._in_node, self._new_node, self._changed = 0.0, True, True
        node = self._automaton.node
        if self._automaton.finished:
            self._end(scene)
            self.states.fire("Done", self._cause or ("" if node.name == "End" else node.name))
            return
        self._node = self._build(node, self._automaton.program)
        self._enter(scene)

    # --- what people see --------------------------------------------------------------------------

    def _status_of(self, now: float, **more: Any) -> ArmStatus:
        """The status at robot time ``now`` [s]; ``more`` is the arm's own part."""
        automaton, goal = self._automaton, self._step.goal
        nowhere: Array = np.zeros(3)
        return ArmStatus(
            t=now,
            state=self.state,
            program=PurePath(automaton.program.path).name if automaton else "",
            node=automaton.node.name if automaton else "",
            event=self._event,
            transitions=automaton.transitions if automaton else 0,
            reason=self.reason or self._note,
            goal_number=0 if goal is None else self._goals,
            goal=nowhere if goal is None else goal,
            **more,
        )

    def _status_is_due(self, now: float) -> bool:
        """Whether a status is to be said; if so the next is due a period later."""
        if not self._changed and now + 1e-9 < self._status_due:
            return False
        self._changed = False
        self._status_due = now + STATUS_PERIOD
        return True
