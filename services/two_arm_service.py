"""The executive of two arms as a service."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from arm.grasping.executive import GraspExecutive
from arm.grasping.nodes import REGISTRY
from arm.hds import Program, ProgramError, load
from deploy.task import BoxTask, find_program
from deploy.tomlfile import BadFile
from services.service import Inbox, Outbox, Reply, act_on
from services.topics import ARM_COMMAND, ARM_STATE, ARM_STATUS, ESTIMATE, OBJECT, Topic
from sim.scenario import Scenario


class TwoArmService:
    """The executive of two arms."""

    name = "arm"
    period = 0.001
    inputs: tuple[Topic, ...] = (ARM_STATE, ESTIMATE, OBJECT)
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

    def __init__(self, scenario: Scenario, live: bool, restarted: bool) -> None:
        box = scenario.task.box or BoxTask()
        self.executive = GraspExecutive(scenario.robot, box.size)
        path = scenario.program_path()
        self._program: Program | None = load(path, REGISTRY) if path else None
        self._start_at = scenario.task.start_at
        # live, the supervisor starts the program, once every service is there
        self._waiting = scenario.task.autostart and self._program is not None and not live
        if restarted:
            self.executive.reason = "restarted; start the program again when the robot is clear"
        self._t = -1.0

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Answer the newest state of the arms, once."""
        state = inbox.latest(ARM_STATE)
        if state is None or state.t <= self._t or not state.of(14, 2):
            return []
        self._t = state.t
        self.executive.see_box(inbox.latest(OBJECT))
        command, status = self.executive.step(state, inbox.latest(ESTIMATE))
        if self._waiting and now >= self._start_at and self.executive.sees:
            self._waiting = False
            assert self._program is not None
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
            acts["start"] = lambda: executive.start(program)
        return act_on(acts, verb)

    def _load(self, name: str) -> Program:
        if not name:
            if self._program is None:
                raise ValueError("the scenario has no program; name one")
            return self._program
        try:
            path = Path(name)
            return load(path if path.is_file() else find_program(name), REGISTRY)
        except (ProgramError, BadFile, OSError) as error:
            raise ValueError(str(error)) from None

    def state(self) -> tuple[str, str]:
        """State and reason of the executive."""
        return self.executive.state, self.executive.reason
