"""The requests to whoever runs programs, and the states they lead through.

States: ``idle``, ``running``, ``paused``, ``safe_hold`` (an input failed; waits to be resumed),
``protective_stop`` (a limit was left: a person resets) and ``finished``.
"""

from __future__ import annotations

from arm.hds import ABORT, Automaton, Program
from arm.platform_motion import PlatformMotion


class Requested:
    """States and requests; what to do in each is the subclass's.

    Attributes:
        state, reason: as the module says.
    """

    who = "arm"

    def __init__(self) -> None:
        self.state = "idle"
        self.reason = ""
        self._automaton: Automaton | None = None
        self._platform = PlatformMotion()
        self._t: float | None = None
        self._event = self._note = self._cause = ""
        self._start_node = False
        self._changed = False

    def _check(self, program: Program) -> None:
        """Raise ValueError for a program whose nodes cannot be made."""
        raise NotImplementedError

    def _halt(self, give_up: bool) -> None:
        """Stand still with what is held; ``give_up``: the program will not go on."""
        raise NotImplementedError

    @property
    def sees(self) -> bool:
        """Whether there is a usable estimate of the platform."""
        return self._t is not None and not self._platform.problem

    def start(self, program: Program) -> None:
        """Run a checked program from its initial node.

        Raises:
            ValueError: a program is running or interrupted, the arm is stopped, there is no
                estimate, or a node cannot be made of its parameters.
        """
        if self.state not in ("idle", "finished"):
            raise ValueError(f"the {self.who} is {self.state}{self._because()}")
        if self._platform.problem:
            raise ValueError(f"no valid estimate yet: {self._platform.problem}")
        self._check(program)
        self._automaton = Automaton(program)
        self._automaton.start()
        self._event, self._note, self._cause = "start", "", ""
        self._go("running", "")
        self._start_node = True

    def pause(self) -> None:
        """Hold still, with what is held.

        Raises:
            ValueError: no program is running.
        """
        if self.state != "running":
            raise ValueError(f"no program is running: the {self.who} is {self.state}")
        self._interrupt("paused", "asked to pause")

    def resume(self) -> None:
        """Enter the node anew in which the program was interrupted.

        Raises:
            ValueError: nothing to resume, or the cause of the interruption is still there.
        """
        if self.state not in ("paused", "safe_hold"):
            raise ValueError(f"nothing to resume: the {self.who} is {self.state}{self._because()}")
        if self._platform.problem:
            raise ValueError(f"cannot resume yet: {self._platform.problem}")
        self._start_node = self._automaton is not None
        self._event = "resume"
        self._go("running" if self._start_node else "idle", "")

    def jump(self, node: str) -> None:
        """Let an interrupted program go on in another of its nodes once it is resumed.

        Raises:
            ValueError: the program is not interrupted, or has no such node.
        """
        automaton = self._halted()
        if node not in automaton.program.nodes:
            known = ", ".join(automaton.program.nodes)
            raise ValueError(f"there is no node {node!r} to jump to; there are: {known}")
        automaton.reset(node)
        self._event = "jump"
        self._go(self.state, f"goes on in {node}")

    def follow(self, event: str) -> None:
        """Let an interrupted program go on, once resumed, as if its node had raised an event.

        Raises:
            ValueError: as for ``jump``, or the node does not handle the event.
        """
        automaton = self._halted()
        if event not in (*automaton.events, ABORT):
            known = ", ".join((*automaton.events, ABORT))
            raise ValueError(
                f"{automaton.node.name} does not handle {event!r}; it handles: {known}"
            )
        automaton.fire(event)
        self._event = event
        self._go(self.state, f"goes on in {automaton.node.name}")

    def signal(self, name: str) -> None:
        """Tell the program of an event outside it.

        Raises:
            ValueError: always; no node type waits for one.
        """
        raise ValueError(f"no node waits for an event {name!r}")

    def stop(self) -> None:
        """Give the program up and hold still, with what is held.

        Raises:
            ValueError: the arm is in protective stop.
        """
        if self.state == "protective_stop":
            raise ValueError(f"the {self.who} is in protective stop: {self.reason}; reset it first")
        self._give_up()
        self._go("idle", "stopped by request")

    def abort(self) -> None:
        """Go to the program's abort node.

        Raises:
            ValueError: no program is running or interrupted, or there is no valid estimate.
        """
        if self.state not in ("running", "paused", "safe_hold") or self._automaton is None:
            raise ValueError(
                f"no program to abort: the {self.who} is {self.state}{self._because()}"
            )
        if self._platform.problem:
            raise ValueError(f"cannot go on yet: {self._platform.problem}; stop instead")
        self._automaton.fire(ABORT)
        self._event = ABORT
        self._start_node = True
        self._go("running", "")

    def protective_stop(self, reason: str) -> None:
        """Hold still now; only ``reset`` leads out."""
        if self.state == "protective_stop":
            return
        self._give_up()
        self._go("protective_stop", reason)

    def reset(self) -> None:
        """Leave a protective stop, once a person has looked.

        Raises:
            ValueError: the arm is not stopped.
        """
        if self.state != "protective_stop":
            raise ValueError(f"the {self.who} is {self.state}, not in protective stop")
        self._go("idle", "")

    def _halted(self) -> Automaton:
        if self.state not in ("paused", "safe_hold") or self._automaton is None:
            raise ValueError(
                f"the {self.who} is {self.state}{self._because()}; pause the program first"
            )
        return self._automaton

    def _interrupt(self, state: str, reason: str) -> None:
        """Stop the program where it is, so that it can be resumed."""
        self._start_node = False
        self._halt(False)
        self._go(state, reason)

    def _give_up(self) -> None:
        self._halt(True)
        self._start_node = False
        self._automaton = None

    def _go(self, state: str, reason: str) -> None:
        self.state, self.reason = state, reason
        self._changed = True

    def _because(self) -> str:
        return f" ({self.reason})" if self.reason else ""
