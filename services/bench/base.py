"""Measures the platform: clutter, people who cross, docking, positioning; each fusion rule.

Every run is the platform's own code on a kinematic platform with the described sensors: the drive
lags as described give or take a tenth, the floor is rough, the laser noisy and late.
"""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from base.dock import Dock
from base.fusion import RULES as FUSION
from base.planar import wrap
from base.platform import PERIOD, Platform
from deploy.robot import Robot, load_robot
from deploy.task import BaseTask
from sim.kinematic import KinematicRobot
from sim.obstacle_specs import Obstacle, Wall
from sim.worlds import KINDS

ROBOT = "xr4000_puma560"
RULES = tuple(FUSION)
LONGEST = 90.0
"""After this, a run is over [s]."""
_SWING = 0.05  # smallest command whose sign counts [m/s]

Result = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """One run."""

    case: str
    rule: str
    seed: int


@dataclass(frozen=True)
class Setting:
    """A world and what the platform is to do there."""

    obstacles: tuple[Obstacle, ...]
    start: tuple[float, float, float]
    task: dict[str, Any]
    shortest: float = math.nan


def _way(kind: str) -> Callable[[int], Setting]:
    def make(seed: int) -> Setting:
        world = KINDS[kind](seed)
        task = {"behaviour": "find_way", "goal": world.goal}
        return Setting(world.obstacles, world.start, task, world.shortest)

    return make


def _dock(seed: int) -> Setting:
    """A wall 1 to 2 m away, seen aslant, with its end in view."""
    rng = np.random.default_rng([seed, 11])
    away, slant = rng.uniform(1.0, 2.0), rng.uniform(-0.35, 0.35)
    along = np.array([-math.sin(slant), math.cos(slant)])
    middle = away * np.array([math.cos(slant), math.sin(slant)])
    ends = [tuple(map(float, middle + s * along)) for s in (-1.5, 1.5)]
    wall = Wall(start=(ends[0][0], ends[0][1]), end=(ends[1][0], ends[1][1]), thickness=0.1)
    return Setting((wall,), (0.0, 0.0, 0.0), {"behaviour": "dock", "distance": 0.6})


def _position(seed: int) -> Setting:
    """A pose a few centimetres away, as something quicker leaves it."""
    rng = np.random.default_rng([seed, 12])
    goal = [float(v) for v in rng.uniform(-0.1, 0.1, 3)]
    return Setting((), (0.0, 0.0, 0.0), {"behaviour": "position", "goal": goal})


CASES: dict[str, Callable[[int], Setting]] = {
    "clutter": _way("clutter"),
    "crossing": _way("crossing"),
    "doorway": _way("doorway"),
    "corridor": _way("corridor"),
    "dock": _dock,
    "position": _position,
}
ENDED = ("arrived", "docked")


def run_one(job: Job) -> Result:
    """One run; arrival must last for a second."""
    setting = CASES[job.case](job.seed)
    robot = load_robot(ROBOT)
    task = BaseTask.model_validate({**setting.task, "fusion": job.rule})
    platform = Platform(robot, task, avoid=True)
    plant = KinematicRobot(robot, setting.obstacles, setting.start, job.seed)
    command = np.zeros(3)
    commands, headings, costs = [command, command], [0.0, 0.0], []
    at_scans, newest = [], None
    standing, now, reason = 0.0, 0.0, ""
    for i in range(round(LONGEST / PERIOD)):
        now = i * PERIOD
        estimate, scan, bumper = plant.step(now, command)
        begun = time.thread_time()
        message, status = platform.step(now, estimate, None, scan, bumper)
        costs.append(time.thread_time() - begun)
        if scan is not newest:
            at_scans.append(costs[-1])
            newest = scan
        command = message.velocity
        commands.append(command)
        headings.append(float(plant.pose[2]))
        reason = f"{status.state}: {status.reason}" if status.reason else status.state
        standing = standing + PERIOD if status.state in ENDED else 0.0
        if standing >= 1.0 or plant.collided:
            break
    given = np.array(commands)
    result: Result = {
        "case": job.case,
        "rule": job.rule,
        "seed": job.seed,
        "outcome": "collided" if plant.collided else reason,
        "arrived": standing >= 1.0,
        "collided": plant.collided,
        "clearance_mm": plant.clearance * 1e3,
        "time_s": now,
        "length_ratio": plant.travelled / setting.shortest if standing >= 1.0 else None,
        "direct": standing >= 1.0 and plant.travelled <= 1.3 * setting.shortest,
        "swings_per_min": _swings(given, np.array(headings)) / max(now / 60.0, 1e-9),
        "step_ms": float(np.median(costs)) * 1e3,
        "scan_ms": float(np.median(at_scans)) * 1e3 if at_scans else None,
        "step_p99_ms": float(np.percentile(costs, 99)) * 1e3,
        **_limits(robot, given),
        **_accuracy(platform, plant, setting),
    }
    return result


def _limits(robot: Robot, commands: np.ndarray) -> Result:
    """Largest acceleration and jerk of the commands, in shares of their limits."""
    acceleration = np.diff(commands, axis=0) / PERIOD
    jerk = np.diff(acceleration, axis=0) / PERIOD
    return {
        "acceleration_of_limit": float(
            np.max(np.abs(acceleration) / robot.platform.acceleration_limit)
        ),
        "jerk_of_limit": float(np.max(np.abs(jerk) / robot.chassis.jerk_limit)),
    }


def _swings(commands: np.ndarray, headings: np.ndarray) -> int:
    """How often x or y of the command in W changes its sign within a second: swinging."""
    c, s = np.cos(headings), np.sin(headings)
    vx, vy = commands[:, 0], commands[:, 1]
    count = 0
    for column in (c * vx - s * vy, s * vx + c * vy):
        signs = [(i, v > 0) for i, v in enumerate(column) if abs(v) > _SWING]
        count += sum(a[1] != b[1] and (b[0] - a[0]) * PERIOD < 1.0 for a, b in pairwise(signs))
    return count


def _accuracy(platform: Platform, plant: KinematicRobot, setting: Setting) -> Result:
    """Final error by the platform's own sensors and in truth [mm, deg]; of a place or a surface."""
    if "goal" in setting.task:
        return _off_goal(plant, np.array(setting.task["goal"]))
    dock, wall = platform.main, setting.obstacles[0]
    assert isinstance(dock, Dock) and isinstance(wall, Wall)
    return _off_surface(dock, plant, wall, setting.task["distance"])


def _off_goal(plant: KinematicRobot, goal: np.ndarray) -> Result:
    out: Result = {}
    for name, pose in (("own", plant.estimate.pose), ("true", plant.pose)):
        out[f"{name}_mm"] = float(np.hypot(*(goal - pose)[:2])) * 1e3
        out[f"{name}_deg"] = abs(math.degrees(wrap(goal[2] - pose[2])))
    return out


def _off_surface(dock: Dock, plant: KinematicRobot, wall: Wall, distance: float) -> Result:
    """Of the line that the platform has fitted, if it has, and of the wall that is there."""
    out: Result = {}
    own = plant.estimate.pose
    if dock.line is not None:
        height, facing = dock.line.height(own[:2]), dock.line.direction + math.pi - own[2]
        out["own_mm"] = abs(height - distance) * 1e3
        out["own_deg"] = abs(math.degrees(wrap(facing)))
    (x0, y0), (x1, y1) = wall.start, wall.end
    along = np.array([x1 - x0, y1 - y0]) / math.dist(wall.start, wall.end)
    normal = np.array([-along[1], along[0]])  # its sign does not matter
    height = abs(float(normal @ (plant.pose[:2] - [x0, y0]))) - wall.thickness / 2
    out["true_mm"] = abs(height - distance) * 1e3
    facing = math.degrees(wrap(math.atan2(along[1], along[0]) - math.pi / 2 - plant.pose[2]))
    out["true_deg"] = abs(facing)
    return out


def measure(
    jobs: Iterable[Job],
    workers: int,
    watch: Callable[[Iterable[Result]], Iterable[Result]] = iter,
) -> list[Result]:
    """Run jobs, in their order; a result each.

    Args:
        jobs: what to run.
        workers: processes side by side; the cost of a step is only worth something with one.
        watch: is given the results as they come.
    """
    todo = list(jobs)
    if workers == 1:
        return list(watch(map(run_one, todo)))
    # Ctrl-C is for whoever asked, who ends the pool; each worker would print a traceback
    deaf = (signal.SIGINT, signal.SIG_IGN)
    with ProcessPoolExecutor(workers, initializer=signal.signal, initargs=deaf) as pool:
        return list(watch(pool.map(run_one, todo)))
