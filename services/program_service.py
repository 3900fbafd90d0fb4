"""What the services of one arm and of two share: a state is answered once, programs, requests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from arm.hds import Program, ProgramError, Registry, load
from arm.hds.machine import Machine
from deploy.task import find_program
from deploy.tomlfile import BadFile
from services.messages import ArmCommand, ArmState, ArmStatus, Estimate
from services.service import Arrivals, Inbox, Outbox, Reply, act_on
from services.topics import ARM_COMMAND, ARM_STATE, ARM_STATUS, ESTIMATE
from sim.scenario import Scenario


class Runs(Protocol):
    """An executive: runs programs, and answers each state with torques."""

    states: Machine

    @property
    def sees(self) -> bool:
        """Whether there is a usable estimate of the platform."""
        ...

    def start(self, program: Program) -> None:
        """Run a checked program from its initial node."""
        ...

    def step(
        self, state: ArmState, estimate: Estimate | None
    ) -> tuple[ArmCommand, ArmStatus | None]:
        """Torques for one state, and a status when one is due."""
        ...

    def pause(self) -> None: ...  # noqa: D102
    def resume(self) -> None: ...  # noqa: D102
    def stop(self) -> None: ...  # noqa: D102
    def abort(self) -> None: ...  # noqa: D102
    def reset(self) -> None: ...  # noqa: D102
    def jump(self, node: str) -> None: ...  # noqa: D102
    def follow(self, event: str) -> None: ...  # noqa: D102
    def signal(self, name: str) -> None: ...  # noqa: D102
    def protective_stop(self, reason: str) -> None: ...  # noqa: D102


X = TypeVar("X", bound=Runs)


class ProgramService(Generic[X]):
    """The process of an executive.

    Args:
        executive: what it runs.
        registry: node types of its programs.
        joints: of the robot's arms, in all.
        cells: load cells, in all.
        scenario: whose task names the program.
        live: the supervisor starts the program, once every service is there.
        restarted: the process died before; come up waiting for a person.
    """

    name = "arm"
    period = 0.001
    driven_by = Arrivals(ARM_STATE, 0.001)
    verbs: tuple[str, ...] = (
        "start",
        "pause",
        "resume",
        "stop",
        "abort",
        "jump",
        "follow",
        "reset",
        "protective_stop",
        "event",
    )

    def __init__(
        self,
        executive: X,
        registry: Registry,
        joints: int,
        cells: int,
        scenario: Scenario,
        live: bool,
        restarted: bool,
    ) -> None:
        self.executive = executive
        self._registry, self._joints, self._cells = registry, joints, cells
        path = scenario.program_path()
        self._program: Program | None = load(path, registry) if path else None
        self._start_at = scenario.task.start_at
        self._waiting = scenario.task.autostart and self._program is not None and not live
        if restarted:
            executive.states.reason = "restarted; start the program again when the robot is clear"
        self._t = -1.0

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Answer the newest state of the arm, once; one of another robot is not answered."""
        state = inbox.latest(ARM_STATE)
        if state is None or state.t <= self._t or not state.of(self._joints, self._cells):
            return []
        self._t = state.t
        self._look(inbox)
        command, status = self.executive.step(state, inbox.latest(ESTIMATE))
        ready = self.executive.sees and self.executive.states.can("Start")
        if self._waiting and now >= self._start_at and ready:
            self._waiting = False
            assert self._program is not None
            self._refuse(self._program)
            self.executive.start(self._program)
        out: Outbox = [(ARM_COMMAND, command)]
        if status is not None:
            out.append((ARM_STATUS, status))
        return out

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """``start`` (a ``program`` by name or path, or the task's own), and the other verbs."""
        executive = self.executive
        acts: dict[str, Callable[[], None]] = {
            "pause": executive.pause,
            "resume": executive.resume,
            "stop": executive.stop,
            "abort": executive.abort,
            "jump": lambda: executive.jump(str(args.get("node", ""))),
            "follow": lambda: executive.follow(str(args.get("event", ""))),
            "reset": executive.reset,
            "event": lambda: executive.signal(str(args.get("name", ""))),
            "protective_stop": lambda: executive.protective_stop(
                str(args.get("reason", "asked for by a person"))
            ),
        }
        if verb == "start":
            program = self._load(str(args.get("program", "")))
            if executive.sees:  # without an estimate the start itself is refused
                self._refuse(program)
            acts["start"] = lambda: executive.start(program)
        act = act_on(acts, verb)

        def asked() -> Reply:
            reply = act()
            if reply.accepted and verb in ("start", "stop"):
                self._waiting = False  # a person has decided what is to run
            return reply

        return asked

    def state(self) -> tuple[str, str]:
        """State and reason of the executive."""
        return self.executive.states.state, self.executive.states.reason

    def _look(self, inbox: Inbox) -> None:
        """Hand over what else the executive goes by."""
        raise NotImplementedError

    def _refuse(self, program: Program) -> None:
        """Raise ValueError for a program that cannot be done from here."""

    def _load(self, name: str) -> Program:
        if not name:
            if self._program is None:
                raise ValueError("the scenario has no program; name one")
            return self._program
        try:
            path = Path(name)
            return load(path if path.is_file() else find_program(name, key=""), self._registry)
        except BadFile as error:  # a person asked by name: our own folders say nothing to them
            raise ValueError("; ".join(error.findings)) from None
        except (ProgramError, OSError) as error:
            raise ValueError(str(error)) from None
