"""The four services: each wraps one component and knows which topics it reads and writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from arm.executive import Executive
from arm.hds import Program, ProgramError, load
from arm.nodes import REGISTRY
from base.platform import PERIOD as BASE_PERIOD
from base.platform import Platform
from deploy.robot import load_robot
from deploy.task import find_program
from deploy.tomlfile import BadFile
from observer.baselines import TruthReference
from observer.observer import make_observer
from services import messages as m
from services.service import Inbox, Outbox, Reply, Service
from services.topics import (
    ARM_COMMAND,
    ARM_STATE,
    ARM_STATUS,
    BASE_COMMAND,
    BASE_STATUS,
    ESTIMATE,
    IMU,
    ODOMETRY,
    TRUTH,
    Topic,
)
from sim.scenario import Scenario, load_scenario
from sim.simulator import Simulator

ARM_SILENT = 0.1
"""The platform stops when an arm that was heard has been silent for this long [s]."""


class SimService:
    """The simulated robot."""

    name = "sim"
    period = 0.001
    inputs: tuple[Topic, ...] = (ARM_COMMAND, BASE_COMMAND)
    verbs: tuple[str, ...] = ("disturb",)
    _topic: ClassVar[dict[type[m.Message], Topic]] = {
        m.ArmState: ARM_STATE,
        m.Odometry: ODOMETRY,
        m.Imu: IMU,
        m.Truth: TRUTH,
    }

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.simulator = Simulator(scenario, seed)
        self._now = 0.0

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Publish what the robot senses at ``now``, then advance it by 1 ms."""
        self._now = now
        arm, base = inbox.latest(ARM_COMMAND), inbox.latest(BASE_COMMAND)
        return [(self._topic[type(x)], x) for x in self.simulator.step(now, arm, base)]

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """``disturb``: kind and its options."""
        options = dict(args)
        kind = str(options.pop("kind", ""))
        made = self.simulator.make_disturbance(kind, options, self._now)

        def act() -> Reply:
            begun = self.simulator.disturb(made, self._now)
            return Reply(True, f"{kind} from t = {begun.t:.3f} s")

        return act

    def state(self) -> tuple[str, str]:
        """Running, and what disturbs it."""
        return "running", ""


class ObserverService:
    """The platform-motion observer."""

    name = "observer"
    period = 0.002
    verbs: tuple[str, ...] = ()

    def __init__(self, kind: str, robot: str) -> None:
        self._observer = make_observer(kind, load_robot(robot))
        # truth is for reference runs alone: no other kind so much as subscribes to it
        self._truth = self._observer if isinstance(self._observer, TruthReference) else None
        self.inputs: tuple[Topic, ...] = (ODOMETRY, IMU, BASE_COMMAND)
        if self._truth is not None:
            self.inputs += (TRUTH,)
        self._state = ("starting", "")

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Fuse what arrived, publish the estimate at ``now``."""
        if self._truth is not None:
            for truth in inbox.new(TRUTH):
                self._truth.tell(truth.t, truth.pose, truth.velocity, truth.acceleration)
        estimate = self._observer.step(
            now, inbox.new(ODOMETRY), inbox.new(IMU), inbox.new(BASE_COMMAND)
        )
        self._state = ("valid" if estimate.valid else "invalid", estimate.reason)
        return [(ESTIMATE, estimate)]

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """The observer answers no requests."""
        raise ValueError(f"the observer does not answer {verb!r}")

    def state(self) -> tuple[str, str]:
        """Whether the newest estimate is valid, and why not."""
        return self._state


class BaseService:
    """The platform's behaviours."""

    name = "base"
    period = BASE_PERIOD
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
        return _act(acts, verb)

    def state(self) -> tuple[str, str]:
        """The behaviour in charge, and why it does not drive if it does not."""
        return self._status.state, self._status.reason


class ArmService:
    """The arm's executive."""

    name = "arm"
    period = 0.001
    inputs: tuple[Topic, ...] = (ARM_STATE, ESTIMATE)
    verbs: tuple[str, ...] = ("start", "pause", "resume", "stop", "reset", "protective_stop")

    def __init__(self, scenario: Scenario, restarted: bool) -> None:
        self._executive = Executive(scenario.robot, scenario.task.board)
        path = scenario.program_path()
        self._program: Program | None = load(path, REGISTRY) if path else None
        self._start_at = scenario.task.start_at
        self._waiting = scenario.task.autostart and self._program is not None and not restarted
        if restarted:
            self._executive.reason = "restarted; start the program again when the robot is clear"
        self._t = -1.0

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Answer the newest arm state, once."""
        state = inbox.latest(ARM_STATE)
        if state is None or state.t <= self._t:
            return []
        self._t = state.t
        estimate = inbox.latest(ESTIMATE)
        if self._waiting and now >= self._start_at and estimate is not None and estimate.valid:
            self._waiting = False
            assert self._program is not None
            self._executive.start(self._program)
        command, status = self._executive.step(state, estimate)
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
            "reset": executive.reset,
            "protective_stop": lambda: executive.protective_stop(
                str(args.get("reason", "asked for by a person"))
            ),
        }
        if verb == "start":
            program = self._load(str(args.get("program", "")))
            acts["start"] = lambda: executive.start(program)
        return _act(acts, verb)

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
        return self._executive.state, self._executive.reason


def _act(acts: dict[str, Callable[[], None]], verb: str) -> Callable[[], Reply]:
    """The action of a verb, refusing with the reason it raises."""
    if verb not in acts:
        raise ValueError(f"unknown request {verb!r}. Known: {', '.join(acts)}")

    def act() -> Reply:
        try:
            acts[verb]()
        except (ValueError, TypeError) as error:
            return Reply(False, str(error))
        return Reply(True)

    return act


def build_service(
    name: str,
    scenario: str | Path | Scenario,
    seed: int,
    observer: str = "ekf",
    live: bool = False,
    restarted: bool = False,
) -> Service:
    """Build a service.

    Args:
        name: one of ``topics.SERVICES``.
        scenario: name, path, or a scenario already read.
        seed: of the simulation.
        observer: kind of observer.
        live: runs in real time.
        restarted: the process died before; come up waiting for a person.

    Raises:
        BadFile, ProgramError, ValueError: the scenario, its program or a name is wrong.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if name == "sim":
        return SimService(scenario, seed)
    if name == "observer":
        return ObserverService(observer, scenario.robot)
    if name == "base":
        return BaseService(scenario, restarted)
    if name == "arm":
        return ArmService(scenario, restarted)
    raise ValueError(f"unknown service {name!r}. Known: sim, observer, base, arm")


__all__ = ["ArmService", "BaseService", "ObserverService", "SimService", "build_service"]
