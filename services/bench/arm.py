"""Measures the arm: drawing standing and moving, light contact over bumps, late commands, cost.

Every case is a whole system in lockstep. What it costs is counted in processor time of the one
thread it runs in, which other work on the machine disturbs less than the clock on the wall.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from services.components import build_service
from services.run import Run, run_lockstep
from services.topics import ARM_COMMAND, SERVICES, TRUTH
from sim.disturbance import Push
from sim.scenario import Scenario, load_scenario

PUSH = 20.0
"""Force on the last link when its stiffness is measured [N]."""
PUSH_AT = 1.9
"""When: on the way to the first stroke, with all joints in motion [s]."""
PUSH_TIME = 0.25
"""How long [s]."""
LATE = (1, 3, 5)
"""Ticks by which commands come later than they do anyway."""


@dataclass(frozen=True)
class Case:
    """One way to run the system."""

    scenario: str
    observer: str
    late: int = 0
    push: bool = False


CASES: dict[str, Case] = {
    "standing": Case("whiteboard", "truth"),
    "moving, exact state": Case("whiteboard_moving", "truth"),
    "moving, observer": Case("whiteboard_moving", "ekf"),
    "bumps, observer": Case("whiteboard_bumps", "ekf"),
    **{f"commands {n} ms late": Case("whiteboard_moving", "truth", late=n) for n in LATE},
    "pushed": Case("whiteboard_moving", "truth", push=True),
}


@dataclass(frozen=True)
class Goal:
    """A figure of a case, and the most (or least) it may be in every run.

    Attributes:
        label: as people read it.
        case: one of ``CASES``.
        figure: of its result.
        bound: None if there is nothing it must reach.
        least: the bound is a lower one.
    """

    label: str
    case: str
    figure: str
    bound: float | None = None
    least: bool = False

    def met(self, values: list[float]) -> bool | None:
        """Whether every run meets it; None if there is nothing to meet."""
        if self.bound is None or not values:
            return None
        return self.worst(values) >= self.bound if self.least else self.worst(values) <= self.bound

    def worst(self, values: list[float]) -> float:
        """Of several runs."""
        return min(values) if self.least else max(values)


MOVING, OBSERVER, BUMPS = "moving, exact state", "moving, observer", "bumps, observer"
GOALS = (
    Goal("contour rms standing [mm]", "standing", "line_rms_mm", 0.05),
    Goal("contour rms moving, exact state [mm]", MOVING, "line_rms_mm", 0.06),
    Goal("contour rms moving, observer [mm]", OBSERVER, "line_rms_mm"),
    Goal("  over what its error maps to at the pen", OBSERVER, "line_over_estimate", 1.2),
    Goal("force error standing, 20 ms [N]", "standing", "force_rms_error_n", 0.1),
    Goal("force error moving, observer, 20 ms [N]", OBSERVER, "force_rms_error_n", 0.1),
    Goal("force error over bumps at 0.3 m/s, 20 ms [N]", BUMPS, "force_rms_error_n", 0.1),
    Goal("  contact [share of time]", BUMPS, "contact_fraction", 0.99, least=True),
    Goal("  contour rms [mm]", BUMPS, "line_rms_mm"),
    *(
        Goal(
            f"contour rms, commands {n} ms late [mm]", f"commands {n} ms late", "line_rms_mm", 0.12
        )
        for n in LATE
    ),
    Goal("force error, commands 5 ms late [N]", "commands 5 ms late", "force_rms_error_n", 0.2),
    Goal("torque step at node changes [of p99 ripple]", MOVING, "torque_step_fraction", 2.0),
    Goal("stiffness against a push, worst way [kN/m]", "pushed", "stiffness_kn_m"),
    Goal("arm step, median [us]", OBSERVER, "arm_step_us", 120.0),
    Goal("arm step, p99 [us]", OBSERVER, "arm_step_p99_us", 300.0),
    Goal("whole system [times real time]", OBSERVER, "per_core", 5.0, least=True),
)

Result = dict[str, Any]


def measure(
    seeds: Iterable[int],
    workers: int,
    watch: Callable[[Iterable[Result]], Iterable[Result]] = iter,
    cases: Iterable[str] = tuple(CASES),
) -> list[Result]:
    """Run cases over seeds; a result each, with its ``case``.

    Args:
        seeds: of the runs.
        workers: processes side by side; the cost of a step is only worth something with one.
        watch: told of every run that is done, for showing progress.
        cases: names of ``CASES``.
    """
    jobs = [(name, seed) for name in cases for seed in seeds]
    with ProcessPoolExecutor(max_workers=workers) as pool:
        return list(watch(pool.map(run_case, jobs)))


def run_case(job: tuple[str, int]) -> Result:
    """One case with one seed."""
    name, seed = job
    case = CASES[name]
    scenario = load_scenario(case.scenario)
    if case.push:
        figures = {"stiffness_kn_m": stiffness(scenario, seed, case.observer) / 1e3}
        return {"case": name, "seed": seed, "outcome": "running", **figures}
    run, cost = timed(scenario, seed, case.observer, {ARM_COMMAND.name: case.late})
    return {"case": name, **run.result, **cost}


def timed(
    scenario: Scenario, seed: int, observer: str, late: dict[str, int]
) -> tuple[Run, dict[str, float]]:
    """Run a scenario, and count what the arm's step and the whole system cost."""
    services = [build_service(name, scenario, seed, observer) for name in SERVICES]
    arm: Any = services[SERVICES.index("arm")]
    spent: list[int] = []
    step = arm.step

    def counted(now: float, inbox: Any) -> Any:
        began = time.thread_time_ns()
        out = step(now, inbox)
        spent.append(time.thread_time_ns() - began)
        return out

    arm.step = counted
    run = run_lockstep(scenario, seed, observer, late=late, services=services)
    cost = 1e-3 * np.array(spent[100:])  # the first are spent warming up
    return run, {
        "arm_step_us": float(np.median(cost)),
        "arm_step_p99_us": float(np.percentile(cost, 99)),
        "per_core": run.result["simulated_s"] / run.result["processor_s"],
    }


def stiffness(scenario: Scenario, seed: int, observer: str) -> float:
    """What the tip gives way to a push on the last link, arm and platform in motion [N/m].

    The same run with and without the push; the largest difference of the tip along the push, in
    the softer of two directions. In motion, because the friction of a joint at rest would hold
    the push alone.
    """
    until = PUSH_AT + PUSH_TIME
    free = _tips(scenario, seed, observer, until)
    softest = np.inf
    for direction, axis in ((0.0, 2), (90.0, 0)):  # across the board, and along it
        push = Push(t=PUSH_AT, duration=PUSH_TIME, force=PUSH, direction=direction, on="link6")
        pushed = scenario.model_copy(update={"disturbance": (*scenario.disturbance, push)})
        pushed._path = scenario.path
        moved = _tips(pushed, seed, observer, until) - free
        softest = min(softest, PUSH / float(np.abs(moved[:, axis]).max()))
    return float(softest)


def _tips(scenario: Scenario, seed: int, observer: str, until: float) -> np.ndarray:
    log = run_lockstep(scenario, seed, observer, duration=until).log
    return np.array([truth.tip for truth in log.series(TRUTH)])
