"""The platform's side of the robot: asks the behaviours, lets the arbiter choose, says why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path as File
from typing import Any

import numpy as np
from pydantic import ValidationError

from base.approach import Approach
from base.arbiter import Arbiter
from base.behaviour import STOP, Behaviour, Senses, Vote
from base.drive_to import DriveTo
from base.follow_path import FollowPath
from base.hold_still import HoldStill
from base.keep_in_reach import KeepInReach
from base.nodes.build import load_program
from base.paths import Path, build
from base.planar import rotate
from base.program import RunProgram
from base.turn_drive_turn import TurnDriveTurn
from deploy.robot import Equipped
from deploy.task import BaseTask
from services.messages import ArmStatus, BaseCommand, BaseStatus, Estimate

PERIOD = 0.05
"""Time between steps [s]."""
AGE_LIMIT = 0.05
"""Age beyond which an estimate is not driven on [s]."""
_ROLLING = np.array([1.0, 0.0, 1.0])  # what a differential drive can do of V_OB_B


class Platform:
    """Turns a task and the estimate into velocity commands, 20 times a second.

    It publishes a command every step, zero included: silence is for the drive's watchdog. Without
    a usable estimate, after ``stop`` and after a restart it brings the velocity to zero within
    the acceleration limits and says why. Only ``resume`` ends the latter two.

    Args:
        robot: description, for the limits and the lag of the drive.
        task: what to do.
        restarted: the process was running before and died; come up stopped.
        beside: folder that relative paths of programs start from.

    Raises:
        ValueError: the task asks for more than the platform can do.
    """

    def __init__(
        self,
        robot: Equipped,
        task: BaseTask,
        restarted: bool = False,
        beside: File | None = None,
    ) -> None:
        platform = robot.platform
        self._description = platform
        self._differential = robot.chassis.drive == "differential"
        self._beside = beside
        self._reach = robot.reach
        self._arbiter = Arbiter(platform.speed_limit, platform.acceleration_limit, PERIOD)
        self._standing: list[Behaviour] = []
        self._stopped = "restarted; waiting for resume" if restarted else ""
        self._waiting: HoldStill | None = None
        self.set_task(task)

    def add(self, behaviour: Behaviour) -> None:
        """Let a behaviour take part beside whatever the task is, from the next step on.

        Raises:
            ValueError: one of that name takes part already.
        """
        taken = {b.name for b in (*self._standing, self._main)} | {"stop"}
        if behaviour.name in taken:
            raise ValueError(f"a behaviour {behaviour.name!r} takes part already")
        self._standing.append(behaviour)

    def set_task(self, task: BaseTask) -> None:
        """Do something else from the next step on; a stop stays in force.

        Raises:
            ValueError: the task asks for more than the platform can do; the old one goes on.
        """
        self._take(task, self._behaviour(task))

    def _take(self, task: BaseTask, main: Behaviour) -> None:
        self._main = main
        self._task = task
        self._waiting = None

    def set_goal(self, x: float, y: float, heading: float) -> None:
        """Drive to X_OB = (x, y [m], heading [rad]).

        Raises:
            ValueError: not a pose this platform can be asked for.
        """
        self.set_behaviour("drive_to", goal=(x, y, heading))

    def set_behaviour(self, behaviour: str, **options: Any) -> None:
        """Change the task by name.

        Args:
            behaviour: as in the scenario's ``[task.base]`` table.
            **options: the other keys of that table.

        Raises:
            ValueError: unknown name or option; the text says what is allowed.
        """
        self.prepare(behaviour, **options)()

    def prepare(self, behaviour: str, **options: Any) -> Callable[[], None]:
        """As ``set_behaviour``, in two parts: what is returned is quick, and reads no file.

        Raises:
            ValueError: as for ``set_behaviour``.
        """
        try:
            task = BaseTask.model_validate({"behaviour": behaviour, **options})
        except ValidationError as error:
            findings = [
                f"{'.'.join(map(str, e['loc'])) or behaviour}: {e['msg']}" for e in error.errors()
            ]
            allowed = ", ".join(BaseTask.model_fields)
            raise ValueError(f"{'; '.join(findings)}. Keys: {allowed}") from None
        main = self._behaviour(task)
        return lambda: self._take(task, main)

    @property
    def program(self) -> RunProgram:
        """The program that is the task.

        Raises:
            ValueError: the task is none.
        """
        if not isinstance(self._main, RunProgram):
            raise ValueError(f"no program is running: the task is {self._main.name}")
        return self._main

    @property
    def differential(self) -> bool:
        """It cannot move sideways."""
        return self._differential

    @property
    def stopped(self) -> str:
        """Why the platform stands until it is told to resume; empty if it does not."""
        return self._stopped

    @property
    def doing(self) -> str:
        """How far the task is, in one word of its behaviour's."""
        return self._main.state

    def stop(self, reason: str = "stopped by request") -> None:
        """Bring the platform to rest and keep it there until ``resume``."""
        self._stopped = reason

    def resume(self) -> None:
        """End a stop; the task goes on from where the platform is."""
        self._stopped = ""

    def step(
        self, now: float, estimate: Estimate | None, arm: ArmStatus | None = None
    ) -> tuple[BaseCommand, BaseStatus]:
        """One decision.

        Args:
            now: robot time [s].
            estimate: newest from the observer.
            arm: newest status of the arm, for behaviours that care.

        Returns:
            The command, and what each behaviour wanted.
        """
        reason = self._stopped or _unusable(now, estimate)
        votes: dict[str, Vote] = {}
        if reason or estimate is None:
            votes["stop"] = STOP
            state = "stopped"
        else:
            senses = Senses(estimate, arm)
            main = self._main
            if now < self._task.start_at:
                main = self._waiting = self._waiting or HoldStill()
                reason = f"{self._main.name} starts at {self._task.start_at:g} s"
            for behaviour in (main, *self._standing):
                vote = behaviour.vote(now, senses)
                if not np.isfinite(vote.velocity).all():
                    vote, reason = STOP, f"{behaviour.name} asked for a velocity that is no number"
                if self._differential:  # what is not possible shall not weigh on what is
                    vote = replace(vote, velocity=vote.velocity * _ROLLING)
                votes[behaviour.name] = vote
            reason = reason or votes[main.name].reason
            state = main.state
        chosen = self._arbiter.choose(now, votes)
        shown = {name: [*map(float, v.velocity), float(v.weight)] for name, v in votes.items()}
        return (
            BaseCommand(t=now, velocity=chosen),
            BaseStatus(t=now, state=state, reason=reason, votes=shown, chosen=chosen),
        )

    def _behaviour(self, task: BaseTask) -> Behaviour:
        if task.behaviour == "program":
            given = {"goal": task.goal, "object": task.object}
            return RunProgram(
                load_program(task.program, self._beside),
                self._differential,
                self._pace(),
                {k: np.array(v) for k, v in given.items() if v is not None},
            )
        if task.goal is not None and self._differential:
            return TurnDriveTurn(np.array(task.goal), self._pace())
        if task.goal is not None:
            return DriveTo(np.array(task.goal))
        if task.path is not None:
            path = build(task.path)
            self._refuse_too_fast(path)
            lag, dead = self._description.lag, self._description.command_delay
            origin = None if task.origin is None else np.array(task.origin)
            return FollowPath(path, lag, dead + PERIOD / 2, origin)
        if task.behaviour == "keep_in_reach":
            ahead = self._description.command_delay + PERIOD / 2
            return KeepInReach(self._reach, self._description.lag, ahead)
        return HoldStill()

    def _pace(self) -> Approach:
        """How fast a goal is approached."""
        speed, _, turn = self._description.speed_limit
        return Approach(speed=min(0.5, speed), turn=min(0.8, turn))

    def _refuse_too_fast(self, path: Path) -> None:
        horizon = min(path.duration, 60.0)
        times = np.linspace(0, horizon, 1201)
        body = [rotate(-path.pose(s)[2], path.velocity(s)) for s in times]
        peak = np.max(np.abs(body), axis=0)
        for what, asked, limit in zip(
            ("vx", "vy", "yaw rate"), peak, self._description.speed_limit, strict=True
        ):
            if asked > limit + 1e-9:
                raise ValueError(f"the path's {what} reaches {asked:.2f}; the limit is {limit:g}")


def _unusable(now: float, estimate: Estimate | None) -> str:
    """Why the estimate must not be driven on; empty if it may."""
    if estimate is None:
        return "no estimate yet"
    if not estimate.valid:
        return f"estimate invalid: {estimate.reason}" if estimate.reason else "estimate invalid"
    age = now - estimate.t
    if abs(age) > AGE_LIMIT + 1e-9:
        return f"estimate is {age * 1e3:.0f} ms old; the limit is {AGE_LIMIT * 1e3:.0f} ms"
    return ""
