"""The platform's side of the robot: asks the behaviours, lets the arbiter choose, says why."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from base.arbiter import Arbiter
from base.avoid import Avoid
from base.behaviour import STOP, Behaviour, Senses, Vote
from base.follow_path import FollowPath
from base.give_way import GiveWay
from base.hold_still import HoldStill
from base.notice import WARNING, Notice
from base.picture import Picture
from base.planar import rotate
from base.program import RunProgram
from base.progress import Progress
from base.respond_to_contact import RespondToContact
from base.safe_states import platform_states
from base.tasks import Tasks, parse
from deploy.robot import Equipped
from deploy.task import BaseTask
from services.messages import (
    ArmStatus,
    Array,
    BaseCommand,
    BaseStatus,
    Bumper,
    Estimate,
    Scan,
    Vision,
)

PERIOD = 0.05
"""Time between steps [s]."""
STAYS = ("waiting_for_arm", "blocked", "stopped")
"""States that an arm that fails does not change: one that waits, or that a person has to end."""
AGE_LIMIT = 0.05
"""Age beyond which an estimate is not driven on [s]."""
PLANNED = 3
"""Commands that are published ahead; the drive, and so the observer, waits for two at most."""
_ROLLING = np.array([1.0, 0.0, 1.0])  # what a differential drive can do of V_OB_B


class Platform:
    """Turns a task and the estimate into velocity commands, 20 times a second.

    It publishes a command every step, zero included: silence is for the drive's watchdog. Without
    a usable estimate, after ``stop`` and after a restart it brings the velocity to zero within
    the limits and says why. Only ``resume`` ends the latter two. A platform that gets nowhere
    (``base/progress.py``) stands as ``blocked`` until ``resume`` or another task.

    Args:
        robot: description, for the limits and the lag of the drive.
        task: what to do.
        restarted: the process was running before and died; come up stopped.
        beside: folder that relative paths of programs start from.
        avoid: stop before what the laser sees and make way for it, and stand without scans.
        warn: say ``starting`` for a while before moving from rest (``base/notice.py``).

    Attributes:
        picture: what the laser shows, None without one.

    Raises:
        ValueError: the task asks for more than the platform can do.
    """

    def __init__(
        self,
        robot: Equipped,
        task: BaseTask,
        restarted: bool = False,
        beside: Path | None = None,
        avoid: bool = False,
        warn: bool = False,
    ) -> None:
        platform = robot.platform
        self._differential = robot.chassis.drive == "differential"
        speed = np.array(platform.speed_limit)
        self._arbiter = Arbiter(
            speed * _ROLLING if self._differential else speed,
            platform.acceleration_limit,
            PERIOD,
            robot.chassis.jerk_limit,
            task.fusion,
        )
        radius, reach = robot.chassis.radius, robot.reach
        picture = None if robot.laser is None else Picture(robot.laser, radius)
        self.picture = picture
        self._tasks = Tasks(platform, robot.chassis, reach, PERIOD, picture, beside)
        # beside whatever the task is
        self._always: list[Behaviour] = []
        if robot.bumper is not None:
            self._always.append(RespondToContact())
        if avoid and picture is not None:
            self._always.append(Avoid(picture, platform, robot.chassis, PERIOD))
            if not self._differential:
                self._always.append(GiveWay(picture, radius))
        self._progress = Progress()
        self._notice = Notice() if warn else None
        self.states = platform_states()
        if restarted:
            self.stop("restarted; waiting for resume")
        self._waiting: HoldStill | None = None
        self.set_task(task)

    def add(self, behaviour: Behaviour) -> None:
        """Let a behaviour take part beside whatever the task is, from the next step on.

        Raises:
            ValueError: one of that name takes part already.
        """
        taken = {b.name for b in (*self._always, self._main)} | {"stop"}
        if behaviour.name in taken:
            raise ValueError(f"a behaviour {behaviour.name!r} takes part already")
        self._always.append(behaviour)

    def set_task(self, task: BaseTask) -> None:
        """Do something else from the next step on; a stop stays in force.

        Raises:
            ValueError: the task asks for more than the platform can do; the old one goes on.
        """
        self._take(task, self._tasks.behaviour(task))

    def _take(self, task: BaseTask, main: Behaviour) -> None:
        self._main = main
        self._task = task
        self._waiting = None
        if self.states.can("New_task"):
            self.states.fire("New_task", self.stopped)

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
        task = parse(behaviour, **options)
        main = self._tasks.behaviour(task)
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
    def main(self) -> Behaviour:
        """The behaviour that does the task, whether or not it has begun."""
        return self._main

    @property
    def differential(self) -> bool:
        """It cannot move sideways."""
        return self._differential

    @property
    def stopped(self) -> str:
        """Why the platform stands until it is told to resume; empty if it does not."""
        return self.states.reason if self.states.state in ("stopped", "waiting_for_arm") else ""

    @property
    def doing(self) -> str:
        """How far the task is, in one word of its behaviour's."""
        return self._main.state

    def stop(self, reason: str = "stopped by request") -> None:
        """Bring the platform to rest and keep it there until ``resume``."""
        self.states.abort(reason)

    def resume(self) -> None:
        """End a stop; the task goes on from where the platform is."""
        if self.states.can("Resume"):
            self.states.fire("Resume", self.states.reason if self.states.state == "blind" else "")

    def mind_arm(self, failed: str, works: bool) -> None:
        """Stand while the arm cannot make up for the platform's motion.

        Args:
            failed: why it cannot; empty if it has not failed.
            works: it can.
        """
        if failed and self.states.state not in STAYS:
            self.states.fire("Arm_failed", failed)
        elif works and not failed and self.states.state == "waiting_for_arm":
            self.states.fire("Better")

    def step(
        self,
        now: float,
        estimate: Estimate | None,
        arm: ArmStatus | None = None,
        scan: Scan | None = None,
        bumper: Bumper | None = None,
        vision: Mapping[str, Vision] | None = None,
    ) -> tuple[BaseCommand, BaseStatus]:
        """One decision.

        Args:
            now: robot time [s].
            estimate: newest from the observer.
            arm: newest status of the arm, for behaviours that care.
            scan: newest of the laser.
            bumper: newest of the bumpers.
            vision: newest sighting of each object, by its name.

        Returns:
            The command, and what each behaviour wanted.
        """
        self._look(_unusable(now, estimate))
        votes: dict[str, Vote]
        if self.states.type != "Votes" or estimate is None:
            votes, state, reason = {"stop": STOP}, self.states.state, self.states.reason
        else:
            senses = Senses(estimate, arm, scan, bumper, vision or {}, self._arbiter.chosen)
            votes, state, reason = self._ask(now, senses)
        chosen = self._arbiter.choose(now, votes)
        shown = {name: [*map(float, v.velocity), float(v.weight)] for name, v in votes.items()}
        return (
            BaseCommand(
                t=now,
                velocity=chosen,
                planned=self._plan(now, "stop" in votes or self._stands(state, now)),
            ),
            BaseStatus(t=now, state=state, reason=reason, votes=shown, chosen=chosen),
        )

    def _look(self, unusable: str) -> None:
        """Stand while there is no usable estimate."""
        if unusable and self.states.can("Lost"):
            self.states.fire("Lost", unusable)
        elif self.states.state == "blind":
            if unusable:
                self.states.reason = unusable
            else:
                self.states.fire("Better")

    def _ask(self, now: float, senses: Senses) -> tuple[dict[str, Vote], str, str]:
        """The votes of all that take part, by name; state and reason of the platform."""
        votes: dict[str, Vote] = {}
        main, reason = self._main, ""
        if now < self._task.start_at:
            main = self._waiting = self._waiting or HoldStill()
            reason = f"{self._main.name} starts at {self._task.start_at:g} s"
        for behaviour in (main, *self._always):
            if behaviour is main and self._counts_down(now):
                vote = Vote(np.zeros(3), weight=0.0)  # a path's time must not run meanwhile
            else:
                vote = behaviour.vote(now, senses)
            if not np.isfinite(vote.velocity).all():
                vote, reason = STOP, f"{behaviour.name} asked for a velocity that is no number"
            if self._differential:  # what is not possible shall not weigh on what is
                vote = replace(vote, velocity=vote.velocity * _ROLLING)
            votes[behaviour.name] = vote
        says = [votes[main.name].reason, *(v.reason for v in votes.values())]
        reason = reason or next(filter(None, says), "")
        nowhere = self._check(now, senses.estimate, votes, main)
        state = "blocked" if nowhere else main.state
        if nowhere:  # it stands, rather than to feel its way along what holds it
            votes[main.name] = replace(votes[main.name], velocity=np.zeros(3))
        reason = f"{nowhere}: {reason}" if nowhere and reason else nowhere or reason
        if self._warns(now, votes):
            state, reason = "starting", reason or f"about to move; warning for {WARNING:g} s"
        return votes, state, reason

    def _warns(self, now: float, votes: dict[str, Vote]) -> bool:
        """Whether people are being warned; what stands is held until they have been."""
        if self._notice is None:
            return False
        start = self._task.start_at
        if now < start:
            if now >= start - WARNING - 1e-9:
                self._notice.announce(now)
                return True
            return False
        if self._notice.holds(now, votes, self._arbiter.chosen):
            votes["notice"] = STOP
            return True
        return False

    def _check(
        self, now: float, estimate: Estimate, votes: Mapping[str, Vote], main: Behaviour
    ) -> str:
        """Why it gets nowhere; what will not pass by itself is kept."""
        velocity = rotate(-estimate.pose[2], estimate.velocity)
        place, going = estimate.pose[:2], main.state == "driving"
        wanted = votes[main.name].velocity
        outvoted = any(v.weight > 0 for name, v in votes.items() if name != main.name)
        allowed = wanted if outvoted else self._arbiter.fuse(votes)
        command = self._arbiter.chosen
        nowhere = self._progress.check(now, wanted, allowed, command, velocity, place, going)
        if nowhere and not nowhere.startswith("held"):
            self.states.fire("Stuck", nowhere)
        return nowhere

    def _stands(self, state: str, now: float) -> bool:
        """Whether it does not move yet, or not any more, whatever its task will want."""
        return state == "blocked" or self._counts_down(now) or now < self._task.start_at

    def _counts_down(self, now: float) -> bool:
        """Whether people are still being warned that it is about to move."""
        return self._notice is not None and self._notice.counts(now)

    def _plan(self, now: float, stops: bool) -> Array:
        """(n, 3) the commands to come: the path's own future, else on the way to what is wanted."""
        wanted = np.tile(self._arbiter.wanted, (PLANNED, 1))
        if isinstance(self._main, FollowPath) and not stops:
            ahead = self._main.ahead([now + PERIOD * i for i in range(PLANNED + 1)])
            wanted = wanted + (ahead[1:] - ahead[0])
        return self._arbiter.plan(wanted)


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
