"""The arm's executive as a service."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from arm.executive import Executive
from arm.hds import Program, ProgramError, load
from arm.nodes import REGISTRY
from arm.reachable import Reachability
from deploy.task import find_program
from deploy.tomlfile import BadFile
from services.service import Inbox, Outbox, Reply, act_on
from services.topics import ARM_COMMAND, ARM_STATE, ARM_STATUS, BOARD, ESTIMATE, Topic
from sim.scenario import Scenario


class ArmService:
    """The arm's executive."""

    name = "arm"
    period = 0.001
    inputs: tuple[Topic, ...] = (ARM_STATE, ESTIMATE, BOARD)
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

    def __init__(self, scenario: Scenario, live: bool, restarted: bool, seed: int = 0) -> None:
        self._executive = Executive(scenario.robot, scenario.task.board)
        path = scenario.program_path()
        self._program: Program | None = load(path, REGISTRY) if path else None
        if self._program is not None and scenario.task.shape_by_seed:
            self._program = shaped(self._program, seed + 1)
        self._start_at = scenario.task.start_at
        # live, the supervisor starts the program, once every service is there
        self._waiting = scenario.task.autostart and self._program is not None and not live
        if restarted:
            self._executive.reason = "restarted; start the program again when the robot is clear"
        self._reach = Reachability(scenario.robot, scenario.task.board)
        self._t = -1.0

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Answer the newest arm state, once."""
        state = inbox.latest(ARM_STATE)
        if state is None or state.t <= self._t:
            return []
        self._t = state.t
        estimate = inbox.latest(ESTIMATE)
        self._executive.see_board(inbox.latest(BOARD))
        command, status = self._executive.step(state, estimate)
        if self._waiting and now >= self._start_at and self._executive.sees:
            self._waiting = False
            assert self._program is not None
            self._refuse_unreachable(self._program)
            self._executive.start(self._program)
        out: Outbox = [(ARM_COMMAND, command)]
        if status is not None:
            out.append((ARM_STATUS, status))
        return out

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """``start`` (a ``program`` by name or path, or the task's own), and the other verbs."""
        executive = self._executive
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
                self._refuse_unreachable(program)
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

    def _refuse_unreachable(self, program: Program) -> None:
        """Raise ValueError if a node's points are out of reach; takes too long for the loop."""
        self._reach.refuse(program, self._executive.platform_pose)

    def state(self) -> tuple[str, str]:
        """State and reason of the executive."""
        return self._executive.state, self._executive.reason


def shaped(program: Program, shape: int) -> Program:
    """The same program, with parameter ``Shape`` of every node that has one set to ``shape``."""
    nodes = {
        name: replace(node, parameters={**node.parameters, "Shape": shape})
        if "Shape" in node.parameters
        else node
        for name, node in program.nodes.items()
    }
    return replace(program, nodes=nodes)
