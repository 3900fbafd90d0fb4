"""A program of the platform as one behaviour among the others."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

import numpy as np

from arm.hds import ABORT, Automaton, Program
from base.approach import Approach
from base.behaviour import Senses, Vote
from base.nodes import Context, Control, Step, Wait
from base.nodes.build import build
from base.nodes.place import GIVEN
from base.picture import Picture
from base.stand import Stand
from base.turn_drive_turn import range_and_bearing
from services.messages import Array

LONGEST = 0.1
"""More time than this between two votes was a stop, and counts as this much [s]."""


class RunProgram:
    """Votes for what the program's current node wants; the others have their say as ever.

    The program starts with the first vote. Once it has ended the platform keeps its place. A stop
    interrupts no node: each sees where the platform is and drives on from there.

    Args:
        program: checked, of the platform's node types.
        differential: the platform cannot move sideways.
        approach: how fast the platform may go.
        given: (3,) X_OF of the task's ``goal`` and ``object``, those that it gives.
        picture: of the laser, None without one.

    Raises:
        ValueError: a node speaks of a frame that the task does not give, or asks for what this
            platform cannot do.
    """

    name = "program"

    def __init__(
        self,
        program: Program,
        differential: bool,
        approach: Approach,
        given: Mapping[str, Array],
        picture: Picture | None = None,
    ) -> None:
        for node in program.nodes.values():
            if node.type == "Dock" and (differential or picture is None):
                raise ValueError(f"node {node.name}: Dock needs a holonomic platform and a laser")
            of = node.parameters.get("Of")
            if of in GIVEN and of not in given:
                raise ValueError(
                    f"node {node.name} of {self._file(program)} speaks of the {of}, "
                    f"which the task does not give: add {of} = [x, y, heading]"
                )
        self._automaton = Automaton(program)
        self._differential = differential
        self._approach = approach
        self._picture = picture
        self._frames: dict[str, Array] = {"ground": np.zeros(3), **given}
        self._control: Control | None = None
        self._still = Stand()
        self._state = "running"
        self._last: float | None = None
        self._in_node = 0.0
        self._abort = False

    @property
    def state(self) -> str:
        """``running``, ``finished`` or ``aborted``."""
        return self._state

    @property
    def node(self) -> str:
        """Name of the current node, empty before the start."""
        return self._automaton.node.name if self._automaton.started else ""

    @property
    def transitions(self) -> tuple[tuple[str, str], ...]:
        """Events followed so far and the nodes they led to, oldest first."""
        return tuple((s.event, s.target) for s in self._automaton.history)

    def abort(self) -> None:
        """Go to the program's abort node at the next vote.

        Raises:
            ValueError: the program has ended.
        """
        if self._state != "running":
            raise ValueError(f"no program to abort: it is {self._state}")
        self._abort = True

    def signal(self, name: str) -> None:
        """Tell the program of an event outside it.

        Raises:
            ValueError: no node waits for it now.
        """
        if self._state != "running" or not isinstance(self._control, Wait):
            where = f" in {self.node}" if self.node else ""
            raise ValueError(f"no node waits for an event: the program is {self._state}{where}")
        self._control.signal(name)

    def vote(self, now: float, senses: Senses) -> Vote:
        """What the current node wants; its events and guards are followed."""
        if self._last is None:
            self._frames["start"] = senses.estimate.pose.copy()
            self._automaton.start()
            self._enter(self._context(now, 0.0, senses))
        dt = 0.0 if self._last is None else min(now - self._last, LONGEST)
        self._last = now
        context = self._context(now, dt, senses)
        if self._abort:
            self._abort = False
            self._automaton.fire(ABORT)
            self._enter(context)
            self._state = "aborted" if self._automaton.finished else "running"
        if self._control is None:
            return self._named(self._still.vote(now, senses))
        step = self._control.update(context)
        vote = self._named(step.vote)
        self._in_node += dt
        if step.event is not None:
            self._automaton.fire(step.event)
            self._enter(context)
        elif dt > 0.0 and self._automaton.check_guards(self._quantities(context, step)):
            self._enter(context)
        return vote

    def _enter(self, context: Context) -> None:
        """Begin the automaton's current node; it votes from the next step on."""
        self._in_node = 0.0
        if self._automaton.finished:
            self._control = None
            self._state = "finished"
            self._still = Stand()
            return
        self._control = build(self._automaton.node)
        self._control.enter(context)

    def _context(self, now: float, dt: float, senses: Senses) -> Context:
        approach, picture = self._approach, self._picture
        return Context(now, dt, senses, self._frames, self._differential, approach, picture)

    def _quantities(self, context: Context, step: Step) -> dict[str, float]:
        """All that guards may look at [SI]; NaN for what the task does not give."""
        out = {"Time": self._in_node, **step.measures}
        for frame, name in (("goal", "Goal_distance"), ("object", "Object_distance")):
            place = self._frames.get(frame)
            out[name] = float("nan")
            if place is not None:
                out[name] = range_and_bearing(place, context.pose)[0]
        return out

    def _named(self, vote: Vote) -> Vote:
        """The vote with the node it is of for people."""
        what = f"{self._file(self._automaton.program)}: {self.node}"
        reason = f"{what}, {vote.reason}" if vote.reason else what
        return Vote(vote.velocity, vote.weight, vote.bound, vote.limits, reason)

    @staticmethod
    def _file(program: Program) -> str:
        return PurePath(program.path).name
