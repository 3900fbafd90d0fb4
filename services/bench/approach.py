"""Measures the approach policy: how often it ends in front of the object, and how long it takes.

The world is a kinematic platform with a lagging drive on a rough floor and noisy estimates. Each
start is 2 to 2.5 m from the object, up to 120 degrees off its front, with any heading. Table II as
printed, its states looked up anew at every step, is run from the first of the same starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from base.approach import Approach
from base.arbiter import Arbiter
from base.behaviour import Senses, Vote
from base.nodes.build import load_program
from base.planar import difference
from base.platform import PERIOD
from base.program import RunProgram
from base.turn_drive_turn import TurnDriveTurn, range_and_bearing
from deploy.robot import load_robot
from sim.kinematic import KinematicRobot

Array = NDArray[np.float64]

STARTS = 200
LITERAL_STARTS = 40
CASE = "approach"
"""What ``bench base`` calls all of this."""
NEAR = 0.7
"""Distance from which the arms reach the object [m] ..."""
FACING = math.radians(5.0)
"""... and how far off straight ahead it may be [rad]."""
SIDE = math.radians(120.0)
"""How far off the object's front the starts are; from behind it the way would lead over it."""
LIMIT = 120.0
"""Time after which a run is given up [s]."""
PACE = Approach(speed=0.4, turn=0.8, gain=2.0)
OBJECT: Array = np.zeros(3)  # its front is towards x


class Literal:
    """Table II as printed: no memory, and a third state of 0.1 m and 10 degrees.

    It has finished as soon as it is near the object and faces it, be it in passing.
    """

    name = "literal"

    def __init__(self) -> None:
        self.state = "running"
        self.switches = 0
        self._number = 0
        self._drive: TurnDriveTurn | None = None

    def vote(self, now: float, senses: Senses) -> Vote:
        """What the drive of the present state wants."""
        pose = senses.estimate.pose
        if self.state == "finished" or near_and_facing(pose):
            self.state = "finished"
            return Vote(np.zeros(3))
        number = self._place(pose)
        if self._drive is None or number != self._number:
            self.switches += self._drive is not None
            self._number = number
            self._drive = TurnDriveTurn(self._goal(number, pose), PACE, (0.02, 0.02))
        return self._drive.vote(now, senses)

    @staticmethod
    def _place(pose: Array) -> int:
        if math.hypot(pose[0], pose[1]) >= 1.8:
            return 1
        off = difference(np.array([1.5, 0.0, math.pi]), pose)
        there = math.hypot(off[0], off[1]) <= 0.1 and abs(off[2]) <= math.radians(10.0)
        return 3 if there else 2

    @staticmethod
    def _goal(number: int, pose: Array) -> Array:
        if number == 1:
            return np.array([*(1.5 * pose[:2] / math.hypot(pose[0], pose[1])), math.nan])
        return np.array([1.5 if number == 2 else 0.6, 0.0, math.pi])


def near_and_facing(pose: Array) -> bool:
    """Whether a platform at X_OB (3,) is where the approach is to bring it."""
    distance, angle = range_and_bearing(OBJECT, pose)
    return distance <= NEAR and abs(angle) <= FACING


@dataclass(frozen=True)
class Trial:
    """One run.

    Attributes:
        arrived: it ended near the object, facing it.
        time: until it ended [s].
        distance: from the object at its end [m].
        angle: of the object off straight ahead then [rad].
        switches: changes of node or state.
    """

    arrived: bool
    time: float
    distance: float
    angle: float
    switches: int


POLICIES: dict[str, tuple[str, int]] = {
    "approach.hds, differential": ("rmp_puma560", STARTS),
    "approach.hds, holonomic": ("xr4000_puma560", STARTS),
    "Table II as printed, differential": ("rmp_puma560", LITERAL_STARTS),
}
"""What is measured: on which robot, and from how many starts at most."""


def trial(policy: str, seed: int, rule: str = "optimum") -> Trial:
    """One start of a policy; equal seeds give equal starts.

    Raises:
        KeyError: no such policy.
        ValueError: no such fusion rule.
    """
    robot = load_robot(POLICIES[policy][0])
    draw = np.random.default_rng(seed)
    away, side = draw.uniform(2.0, 2.5), draw.uniform(-SIDE, SIDE)
    heading = draw.uniform(-math.pi, math.pi)
    start = np.array([away * math.cos(side), away * math.sin(side), heading])
    world = KinematicRobot(robot, (), start, seed)
    behaviour: Literal | RunProgram = Literal()
    if not policy.startswith("Table"):
        differential = robot.chassis.drive == "differential"
        program = load_program("approach.hds")
        behaviour = RunProgram(program, differential, PACE, {"object": OBJECT})
    platform = robot.platform
    arbiter = Arbiter(
        platform.speed_limit, platform.acceleration_limit, PERIOD, robot.chassis.jerk_limit, rule
    )
    command, step = np.zeros(3), 0
    while step * PERIOD < LIMIT and not (behaviour.state == "finished" and not command.any()):
        now = step * PERIOD
        estimate = world.step(now, command)[0]
        senses = Senses(estimate, command=command)
        command = arbiter.choose(now, {behaviour.name: behaviour.vote(now, senses)})
        step += 1
    distance, angle = range_and_bearing(OBJECT, world.pose)
    arrived = behaviour.state == "finished" and near_and_facing(world.pose)
    if isinstance(behaviour, Literal):
        switches = behaviour.switches
    else:
        switches = len(behaviour.transitions) - 1
    return Trial(arrived, step * PERIOD, distance, abs(angle), switches)


def _trial(job: tuple[str, int, str]) -> Trial:
    return trial(*job)


def jobs(
    starts: int = STARTS, seed: int = 1000, rule: str = "optimum"
) -> list[tuple[str, int, str]]:
    """What ``rows`` runs: policy, seed and fusion rule of each trial."""
    return [
        (policy, seed + i, rule)
        for policy, (_, most) in POLICIES.items()
        for i in range(min(starts, most))
    ]


def rows(
    starts: int = STARTS,
    seed: int = 1000,
    workers: int = 1,
    track: Callable[[Iterable[Trial]], Iterable[Trial]] = iter,
    rule: str = "optimum",
) -> list[dict[str, Any]]:
    """One row a policy.

    Args:
        starts: of each policy; the literal one is run from no more than 40.
        seed: of the first start.
        workers: trials side by side.
        track: told of the trials as they end.
        rule: by which the arbiter fuses.

    Returns:
        policy, starts, arrived (share), median_s and slowest_s of those that arrived, furthest_m
        and worst_deg at the end, and the median of switches.
    """
    todo = jobs(starts, seed, rule)
    with ProcessPoolExecutor(max_workers=workers) as pool:
        done = list(track(pool.map(_trial, todo, chunksize=4)))
    out = []
    for policy in POLICIES:
        mine = [t for (p, _, _), t in zip(todo, done, strict=True) if p == policy]
        times = [t.time for t in mine if t.arrived]
        out.append(
            {
                "policy": policy,
                "starts": len(mine),
                "arrived": sum(t.arrived for t in mine) / len(mine),
                "median_s": median(times) if times else None,
                "slowest_s": max(times) if times else None,
                "furthest_m": max(t.distance for t in mine),
                "worst_deg": math.degrees(max(t.angle for t in mine)),
                "switches": median(t.switches for t in mine),
            }
        )
    return out


def goals(starts: int, seed: int, workers: int, rules: Iterable[str]) -> list[dict[str, Any]]:
    """The rows as ``bench base`` shows them: one a figure, with its value by fusion rule.

    Returns:
        figure, case, runs, a value for each rule, goal, least, and met by rule.
    """
    by_rule = {rule: rows(starts, seed, workers, rule=rule) for rule in rules}
    out = []
    for i, policy in enumerate(POLICIES):
        corrected = not policy.startswith("Table")
        for figure, goal in (("arrived", 1.0 if corrected else None), ("median_s", None)):
            values = {rule: made[i][figure] for rule, made in by_rule.items()}
            out.append(
                {
                    "figure": f"{policy}: {figure}",
                    "case": CASE,
                    "runs": min(starts, POLICIES[policy][1]),
                    **values,
                    "goal": goal,
                    "least": True,
                    "met": {r: None if goal is None else v >= goal for r, v in values.items()},
                }
            )
    return out
