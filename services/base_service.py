"""The platform's behaviours as a service."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from base.platform import PERIOD, Platform
from deploy.robot import load_robot
from services import messages as m
from services.service import Inbox, Outbox, Reply, act_on
from services.topics import ARM_STATUS, BASE_COMMAND, BASE_STATUS, ESTIMATE, Topic
from sim.scenario import Scenario

ARM_SILENT = 0.1
"""The platform stops when an arm that was heard has been silent for this long [s]."""


class BaseService:
    """The platform's behaviours."""

    name = "base"
    period = PERIOD
    inputs: tuple[Topic, ...] = (ESTIMATE, ARM_STATUS)
    verbs: tuple[str, ...] = ("goal", "behaviour", "stop", "resume")

    def __init__(self, scenario: Scenario, restarted: bool) -> None:
        self._platform = Platform(load_robot(scenario.robot), scenario.task.base, restarted)
        self._status = m.BaseStatus(t=0.0)
        self._stopped_for_arm = False

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """One decision of the arbiter."""
        arm = inbox.latest(ARM_STATUS)
        reason = ""
        if arm is not None and inbox.age(ARM_STATUS, now) > ARM_SILENT:
            reason = "the arm is silent"
        elif arm is not None and arm.state in ("safe_hold", "protective_stop"):
            reason = f"the arm is in {arm.state}"  # and does not make up for our motion
        if reason and not self._stopped_for_arm:
            self._platform.stop(reason)
        elif self._stopped_for_arm and not reason:
            self._platform.resume()
        self._stopped_for_arm = bool(reason)
        command, self._status = self._platform.step(now, inbox.latest(ESTIMATE), arm)
        return [(BASE_COMMAND, command), (BASE_STATUS, self._status)]

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """``goal`` x, y, heading; ``behaviour`` and its options; ``stop``; ``resume``."""
        platform = self._platform
        acts: dict[str, Callable[[], None]] = {
            "goal": lambda: platform.set_goal(**{k: float(v) for k, v in args.items()}),
            "behaviour": lambda: platform.set_behaviour(**args),
            "stop": platform.stop,
            "resume": platform.resume,
        }
        return act_on(acts, verb)

    def state(self) -> tuple[str, str]:
        """The behaviour in charge, and why it does not drive if it does not."""
        return self._status.state, self._status.reason
