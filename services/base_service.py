"""The platform's behaviours as a service."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from base.arm_goal import ArmGoal
from base.platform import PERIOD, Platform
from deploy.robot import Equipped, load_robot
from services import messages as m
from services.service import Inbox, Outbox, Reply, act_on
from services.topics import (
    ARM_STATUS,
    BASE_COMMAND,
    BASE_STATUS,
    BUMPER,
    ESTIMATE,
    SCAN,
    VISION,
    Topic,
)
from sim.scenario import Scenario

ARM_SILENT = 0.05
"""The platform stops when an arm that was heard has been silent for this long [s]."""
FAILED = ("safe_hold", "protective_stop")
"""States of an arm that cannot make up for the platform's motion ..."""
WORKING = ("running", "degraded", "resuming", "paused", "finished")
"""... and of one that can again."""


class BaseService:
    """The platform's behaviours, and what of the arm decides whether they may drive.

    Args:
        scenario: for the task, the robot, and which sensors are switched off.
        restarted: the process died before; come up stopped.
    """

    name = "base"
    period = PERIOD
    inputs: tuple[Topic, ...] = (ESTIMATE, ARM_STATUS, SCAN, BUMPER, VISION)
    verbs: tuple[str, ...] = ("goal", "behaviour", "start", "abort", "event", "stop", "resume")

    def __init__(self, scenario: Scenario, restarted: bool) -> None:
        self._task = scenario.task.base
        robot = load_robot(scenario.robot, Equipped)
        off = [k for k in ("laser", "bumper") if not getattr(scenario.sensors, k).enabled]
        robot = robot.model_copy(update=dict.fromkeys(off))
        self._platform = Platform(
            robot, self._task, restarted, scenario.path.parent, avoid=self._task.avoid, warn=True
        )
        self._seen: dict[str, m.Vision] = {}
        self._arm_goal = ArmGoal(self._platform)
        self._status = m.BaseStatus(t=0.0)

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """One decision of the arbiter."""
        arm = inbox.latest(ARM_STATUS)
        self._mind(arm, inbox.age(ARM_STATUS, now))
        self._arm_goal.heed(arm)
        for sighting in inbox.new(VISION):
            self._seen[sighting.name] = sighting
        command, self._status = self._platform.step(
            now,
            inbox.latest(ESTIMATE),
            arm,
            inbox.latest(SCAN),
            inbox.latest(BUMPER),
            self._seen,
        )
        if self._arm_goal.refused:
            self._status = replace(self._status, reason=self._arm_goal.refused)
        return [(BASE_COMMAND, command), (BASE_STATUS, self._status)]

    def _mind(self, arm: m.ArmStatus | None, age: float) -> None:
        """Stand while the arm cannot make up for our motion; go on when it can again.

        An arm that was never heard is no reason to stand, and neither is one that was always
        idle. One that failed must be seen to work, or a person says ``resume``.
        """
        if arm is None:
            return
        failed = ""
        if age > ARM_SILENT:
            failed = "the arm is silent"
        elif arm.state in FAILED:
            failed = f"the arm is in {arm.state}"
        self._platform.mind_arm(failed, arm.state in WORKING)

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """Goals, behaviours, programs, ``stop``, ``resume``.

        ``goal`` x, y, heading; ``behaviour`` and its options; ``start`` a ``program`` by name or
        path (or the task's own) with ``goal`` and ``object`` as in ``[task.base]`` (or the
        task's); ``abort`` it; ``event`` name for a node that waits.
        """
        platform = self._platform
        acts: dict[str, Callable[[], None]] = {
            "goal": lambda: platform.set_goal(**{k: float(v) for k, v in args.items()}),
            "abort": lambda: platform.program.abort(),
            "event": lambda: platform.program.signal(str(args.get("name", ""))),
            "stop": platform.stop,
            "resume": platform.resume,
        }
        if verb == "behaviour":
            acts[verb] = platform.prepare(**{"behaviour": "", **args})
        if verb == "start":
            acts[verb] = platform.prepare("program", **self._program(args))
        act = act_on(acts, verb)

        def answer() -> Reply:
            reply = act()
            if reply.accepted and verb in ("goal", "behaviour", "start") and self._platform.stopped:
                return Reply(True, f"but the platform stands: {self._platform.stopped}")
            return reply

        return answer

    def _program(self, args: dict[str, Any]) -> dict[str, Any]:
        """Options of a program: those asked for, the task's own for the others."""
        own = {
            "program": self._task.program,
            "goal": self._task.goal,
            "object": self._task.object,
        }
        given = {k: v for k, v in own.items() if v not in (None, "")} | args
        if not given.get("program"):
            raise ValueError("the scenario has no program for the platform; name one")
        return given

    def state(self) -> tuple[str, str]:
        """The behaviour in charge, and why it does not drive if it does not."""
        return self._status.state, self._status.reason
