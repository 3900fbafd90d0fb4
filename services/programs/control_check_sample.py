"""Runs of a program in lockstep, varied by a seed, with the state at every transition."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from arm.nodes.conditions import State
from deploy.task import BoardPose
from services.components import build_service
from services.lockstep import TICK, Lockstep
from services.messages import ArmStatus, Message, Truth
from services.run import without_collector
from services.topics import ARM_STATUS, SERVICES, TRUTH, Topic
from sim.scenario import SCENARIOS, Scenario, load_scenario

START = (0.02, 0.02, math.radians(1.0))
"""Most that the platform starts elsewhere than the scenario says: x, y [m], heading [rad]."""
BOARD = (0.005, 0.005, 0.005, math.radians(0.5))
"""Most that the board is elsewhere than the scenario says: x, y, z [m], yaw [rad]."""
SHIFT = 0.5
"""Most that a disturbance comes earlier or later [s]."""
OVER = ("safe_hold", "protective_stop", "idle")
"""States of the arm in which a program that ran has been given up."""


@dataclass(frozen=True)
class Passage:
    """One transition of a run, with the state when it was taken."""

    t: float
    source: str
    event: str
    target: str
    state: State


@dataclass(frozen=True)
class Sample:
    """A run: its transitions in order, and how it ended.

    Attributes:
        seed: that replays it.
        passages: transitions in the order they were taken.
        end: ``finished``, ``time`` when its time was over, or what stopped it.
    """

    seed: int
    passages: tuple[Passage, ...]
    end: str


def varied(scenario: Scenario, seed: int) -> Scenario:
    """The scenario with platform start, board and disturbances' times varied by a seed.

    The truth is varied, what the controllers believe stays. The mismatch of the simulated robot
    and the noise of the sensors follow the seed of the run.
    """
    rng = np.random.default_rng([seed, 0xC0])
    world = scenario.world
    start = np.array(world.platform_start) + rng.uniform(-1.0, 1.0, 3) * START
    keys = ("x", "y", "z", "yaw")
    moved = rng.uniform(-1.0, 1.0, 4) * BOARD
    board = {k: getattr(world.board, k) + float(d) for k, d in zip(keys, moved, strict=True)}
    shifted = tuple(
        d.model_copy(update={"t": max(d.t + float(rng.uniform(-SHIFT, SHIFT)), 0.0)})
        for d in scenario.disturbance
    )
    truth = world.model_copy(
        update={
            "platform_start": tuple(start.tolist()),
            "board": world.board.model_copy(update=board),
        }
    )
    return scenario.model_copy(update={"world": truth, "disturbance": shifted})


def scenario_for(program: Path, name: str | None = None) -> Scenario:
    """A scenario with its program replaced: the named one, or the first that runs the program.

    Raises:
        BadFile: there is no such scenario.
    """
    if name is None:
        known = {load_scenario(p).task.program: p.stem for p in sorted(SCENARIOS.glob("*.toml"))}
        name = known.get(program.name, "whiteboard")
    scenario = load_scenario(name)
    task = scenario.task.model_copy(update={"program": str(program.resolve()), "autostart": True})
    return scenario.model_copy(update={"task": task})


def sample(scenario: Scenario, seed: int, observer: str = "ekf") -> Sample:
    """Run a scenario, varied by the seed, and record its transitions."""
    scenario = varied(scenario, seed)
    watch = Watch(scenario.world.board, scenario.task.board)
    services = [build_service(name, scenario, seed, observer) for name in SERVICES]
    lockstep = Lockstep(services, listener=watch)
    limit = round(scenario.duration / TICK)
    try:
        with without_collector():
            while lockstep.tick < limit and not watch.end:
                lockstep.step()
    except ValueError as error:  # the program was refused
        return Sample(seed, tuple(watch.passages), f"refused: {error}")
    return Sample(seed, tuple(watch.passages), watch.end or "time")


class Watch:
    """Listens to a run and notes the state at every transition.

    Args:
        true: where the board is, X_WS.
        believed: where the controllers take it to be, X_OS.
    """

    def __init__(self, true: BoardPose, believed: BoardPose) -> None:
        # the wheels count from where the platform truly starts: O is W, but for what they slip
        self._R_OS, self._p_OS = believed.rotation(), believed.position()
        self._R = believed.rotation().T @ true.rotation()
        self._p = believed.rotation().T @ (true.position() - believed.position())
        self._truth: Truth | None = None
        self._node = ""
        self._transitions = 0
        self._entry: State | None = None
        self.passages: list[Passage] = []
        self.end = ""

    def __call__(self, topic: Topic, message: Message, now: float) -> None:
        """Hear a message."""
        if topic is TRUTH and isinstance(message, Truth):
            self._truth = message
        elif topic is ARM_STATUS and isinstance(message, ArmStatus):
            self._hear(message, now)

    def _hear(self, status: ArmStatus, now: float) -> None:
        if status.transitions > self._transitions:
            state = self._state(status)
            passage = Passage(now, self._node, status.event, status.node, state)
            self.passages.append(passage)
            self._entry = state
        elif status.node and not self._node:
            self._entry = self._state(status)
        self._transitions = status.transitions
        self._node = status.node or self._node
        if status.state == "finished":
            self.end = "finished"
        elif status.state in OVER and self._node:
            self.end = f"{status.state}: {status.reason}"

    def _state(self, status: ArmStatus) -> State:
        truth = self._truth
        assert truth is not None  # the simulation speaks first
        tip = self._R @ truth.tip + self._p
        ground = self._R_OS @ tip + self._p_OS
        entry = self._entry
        return State(
            tip=tip,
            clearance=float(truth.tip[2]),
            force=truth.force,
            joint_margin=status.joint_margin,
            reach_margin=status.reach_margin,
            entered=tip if entry is None else entry.tip,
            ground=ground,
            platform=truth.pose,
            entered_ground=ground if entry is None else entry.ground,
            entered_platform=truth.pose if entry is None else entry.platform,
        )


def sample_many(
    scenario: Scenario, seeds: Iterable[int], observer: str = "ekf", workers: int = 1
) -> Iterator[Sample]:
    """Runs for several seeds as they come, in this process or in several."""
    seeds = list(seeds)
    if workers <= 1 or len(seeds) <= 1:
        for seed in seeds:
            yield sample(scenario, seed, observer)
        return
    with ProcessPoolExecutor(max_workers=min(workers, len(seeds))) as pool:
        n = len(seeds)
        yield from pool.map(sample, [scenario] * n, seeds, [observer] * n)
