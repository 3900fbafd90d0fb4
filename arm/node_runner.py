"""What every arm's executive does at a tick but for the arm: the program's nodes, and the status.

It keeps the time between the states of the joints, follows the platform, steps what is in control,
follows its events and guards, and tells of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any, Protocol, runtime_checkable

import numpy as np

from arm.hds import Program
from arm.joint_limits import Watched
from arm.platform_motion import PlatformMotion
from arm.program_runner import ProgramRunner
from services.messages import ArmState, ArmStatus, Array, Estimate

LONGEST_TICK = 0.05
"""After a gap in the joints' state longer than this everything starts anew [s]."""
STATUS_PERIOD = 0.02
"""[s]"""


@runtime_checkable
class Waits(Protocol):
    """A node that waits for an event from outside."""

    def signal(self, name: str) -> None:
        """An event has come; ValueError if it is not the one waited for."""
        ...


class NodeRunner(ProgramRunner):
    """Runs the current node, follows its events and guards, and tells of it.

    Args:
        who: for texts, "the arm is".
        build: the control of a node of a program; ValueError if it cannot be made.
        step: what a node answers at a tick, of an arm that does nothing.
        period: of the joints' state [s].
        limits: of the arm.
    """

    def __init__(self, who: str, build: Any, step: Any, period: float, limits: Watched) -> None:
        super().__init__(who, build)
        self._period, self._watched = period, limits
        self._platform = PlatformMotion()
        self._t: float | None = None
        self._node: Any = None
        self._step = step
        self._been: set[str] = set()
        """Nodes entered since the program began, or since it came back to one of them."""
        self._cause = ""  # of the newest event that had one: why a program ended as it did
        self._in_node = 0.0
        self._new_node = False
        self._goals = 0
        self._status_due = 0.0

    # --- what an arm does about it ------------------------------------------------------------

    def _after_gap(self, state: ArmState) -> None:
        """Begin at a state of the joints: the first, or the first after a gap."""

    def _without_estimate(self, problem: str) -> None:
        """Whatever relies on the platform's motion must stop relying on it."""
        if self._moving:
            self._interrupt("Failed", problem)
        elif self.state == "safe_hold":
            self.states.reason = problem

    def _prepare(self, scene: Any) -> None:
        """What comes before a step."""

    @property
    def _steps(self) -> bool:
        """Whether there is something to step."""
        return self._working

    def _advance(self, scene: Any) -> Any:
        """The next step of what is in control; None if it was interrupted instead."""
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

    def _more(self, now: float) -> Mapping[str, Any]:
        """The arm's own part of a status at robot time ``now`` [s]."""
        raise NotImplementedError

    # --- requests -------------------------------------------------------------------------------

    def start(self, program: Program) -> None:
        """Run a checked program from its initial node; ValueError as any executive."""
        super().start(program)
        self._been.clear()
        self._cause = ""

    def signal(self, name: str) -> None:
        """Tell the program of an event outside it.

        Raises:
            ValueError: no node waits for it now.
        """
        if not self._working or not isinstance(self._node, Waits):
            where = f" in {self._automaton.node.name}" if self._automaton else ""
            raise ValueError(f"no node waits for an event: {self.states}{where}")
        self._node.signal(name)

    def reset(self) -> None:
        """Leave a protective stop; ValueError if it is not in one."""
        super().reset()
        self._watched.excuse()

    @property
    def sees(self) -> bool:
        """Whether there is a usable estimate of the platform."""
        return self._t is not None and not self._platform.problem

    @property
    def _moving(self) -> bool:
        """Whether a program has the arm, or it is on its way back to one."""
        return self._working or self.state == "resuming"

    def _problem(self) -> str:
        return self._platform.problem

    # --- the tick ---------------------------------------------------------------------------------

    def _begin(self, state: ArmState, estimate: Estimate | None) -> float:
        """Come to the instant of a state, and what the platform is doing then.

        Returns:
            Time since the last state, a period if there is none to go on from [s].
        """
        before, self._t = self._t, state.t
        dt = self._period if before is None else state.t - before
        if before is None or dt > LONGEST_TICK:
            dt = self._period
            self._after_gap(state)
            if before is not None and self._moving:
                self._interrupt("Failed", "the arm's own state was late")
        problem = self._platform.follow(dt, state.t, estimate)
        if problem:
            self._without_estimate(problem)
        elif estimate is not None:
            self._look_at_age(state.t - estimate.t)
        return dt

    def _run(self, scene: Any) -> None:
        """Step what is in control, follow its events and guards."""
        self._new_node = False
        if self._start_node:
            self._start_node = False
            self._next_node(scene)
        self._prepare(scene)
        self._update(scene)
        if self._guarded(scene):
            self._update(scene)
        # what follows takes over within this tick; the language refuses cycles that take no time
        while self._step.event is not None and self._follow(scene):
            self._update(scene)

    def _update(self, scene: Any) -> None:
        """Take one step of what is in control."""
        before = self._step.goal
        step = self._advance(scene) if self._steps else None
        if step is None:
            return
        self._step = step
        if step.goal is None:
            self._changed |= before is not None
        elif before is None or (step.goal != before).any():
            self._goals += 1
            self._changed = True

    def _follow(self, scene: Any) -> bool:
        """Act on the step's event; returns whether anything came of it."""
        if not self._working:
            return False
        assert self._automaton is not None
        self._tell(self._step.event, self._step.reason)
        self._cause = self._step.reason or self._cause
        self._automaton.fire(self._step.event)
        self._next_node(scene)
        return True

    def _guarded(self, scene: Any) -> bool:
        """Follow a guard that holds, unless the node is new or has raised an event."""
        automaton = self._automaton
        if not self._working or automaton is None or self._new_node:
            return False
        self._in_node += scene.dt
        if self._step.event is not None or not automaton.guards:
            return False
        if automaton.check_guards(self._values(scene)) is None:
            return False
        self._tell(automaton.history[-1].event)
        self._cause = ""
        self._next_node(scene)
        return True

    def _next_node(self, scene: Any) -> None:
        """Enter the automaton's current node."""
        assert self._automaton is not None
        self._in_node, self._new_node, self._changed = 0.0, True, True
        node = self._automaton.node
        if node.name in self._been:  # another try: why the last one failed is over
            self._cause = ""
            self._been.clear()
        self._been.add(node.name)
        if self._automaton.finished:
            self._end(scene)
            self.states.fire("Done", "" if node.name == "End" else self._cause or node.name)
            return
        self._node = self._build(node, self._automaton.program)
        self._enter(scene)

    # --- what people see --------------------------------------------------------------------------

    def _status(self, now: float) -> ArmStatus | None:
        """The status at robot time ``now`` [s] if one is due."""
        if not self._changed and now + 1e-9 < self._status_due:
            return None
        self._changed = False
        self._status_due = now + STATUS_PERIOD
        automaton, goal = self._automaton, self._step.goal
        nowhere: Array = np.zeros(3)
        reason = self.reason or self._note
        if self._halting and automaton:
            reason = f"{reason}; interrupted in {automaton.node.name}: resume or stop the program"
        return ArmStatus(
            t=now,
            state=self.state,
            program=PurePath(automaton.program.path).name if automaton else "",
            node=automaton.node.name if automaton else "",
            event=self._event,
            transitions=automaton.transitions if automaton else 0,
            reason=reason,
            joint_margin=self._watched.joint_margin,
            goal_number=0 if goal is None else self._goals,
            goal=nowhere if goal is None else goal,
            **self._more(now),
        )
