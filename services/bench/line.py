"""The line longer than the arm: its figures over seeds, with true wheels and with wrong ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from statistics import median
from typing import Any

import numpy as np

from deploy.robot import load_robot
from services.logs.runlog import RunLog
from services.run import run_lockstep
from services.topics import ARM_STATUS, BOARD, TRUTH
from sim.scenario import OdometrySensor, Scenario, load_scenario

Result = dict[str, Any]

CASE = "line"
"""What ``bench base`` calls all of it."""
MOST = 10
"""Seeds that ``bench base`` runs of it at most."""
SCENARIO = "long_line"
TRUE_WHEELS, WRONG_WHEELS = "drift-free odometry", "wheels 0.5 % wrong, a slip, board seen"
CASES = (TRUE_WHEELS, WRONG_WHEELS)
GOALS: tuple[tuple[str, str, float, bool], ...] = (
    ("tracked_rms_mm", "tracked error rms [mm]", 0.7, False),
    ("contact_fraction", "pen on the board [share of time]", 0.99, True),
    ("reach_least", "least reach margin [share of reach]", 0.1, True),
    ("clearance_mm", "least clearance of the platform [mm]", 0.0, True),
)
"""Figure, label, bound, and whether the bound is a lower one."""
DRIFTING_MM = 2.0
"""Goal for the tracked error where odometry drifts [mm]."""


def scenario_of(case: str, rule: str = "optimum") -> Scenario:
    """The scenario of a case; where odometry is true it neither slips nor needs the camera.

    Args:
        case: one of ``CASES``.
        rule: by which the platform's votes are fused.
    """
    scenario = load_scenario(SCENARIO)
    base = scenario.task.base.model_copy(update={"fusion": rule})
    path, task = scenario.path, scenario.task.model_copy(update={"base": base})
    scenario = scenario.model_copy(update={"task": task})
    scenario._path = path
    if case == WRONG_WHEELS:
        return scenario
    sensors = scenario.sensors.model_copy(update={"odometry": OdometrySensor()})
    task = scenario.task.model_copy(update={"watch_board": False})
    still = scenario.model_copy(update={"sensors": sensors, "disturbance": (), "task": task})
    still._path = scenario.path
    return still


def measure(
    seeds: Iterable[int],
    workers: int = 1,
    watch: Callable[[Iterable[Result]], Iterable[Result]] = iter,
    cases: Iterable[str] = CASES,
    rule: str = "optimum",
) -> list[Result]:
    """Run cases over seeds; a result each, with its ``case``.

    Args:
        seeds: of the runs; each draws a line of its own.
        workers: processes side by side.
        watch: told of every run that is done, for showing progress.
        cases: names of ``CASES``.
        rule: by which the platform's votes are fused.
    """
    jobs = [(case, seed, rule) for case in cases for seed in seeds]
    with ProcessPoolExecutor(max_workers=workers) as pool:
        return list(watch(pool.map(run_case, jobs)))


def run_case(job: tuple[str, int, str]) -> Result:
    """One case with one seed and fusion rule."""
    case, seed, rule = job
    scenario = scenario_of(case, rule)
    run = run_lockstep(scenario, seed)
    return {
        "case": case,
        **run.result,
        **figures_of_line(run.log, load_robot(scenario.robot).arm.reach),
    }


def figures_of_line(log: RunLog, reach: float) -> dict[str, float | None]:
    """What a drawing's figures do not say: what was left of a reach [m], how it was shared."""
    drawing = [s for s in log.series(ARM_STATUS) if s.stroke]
    if not drawing:
        return dict.fromkeys(("reach_least", "clearance_mm"))
    inside = [x for x in log.series(TRUTH) if drawing[0].t <= x.t <= drawing[-1].t]
    platform = np.array([x.pose[:2] for x in inside])
    tip = np.array([x.tip[:2] for x in inside])
    board = log.series(BOARD)
    return {
        "reach_least": min(s.reach_margin for s in drawing) / reach,
        "clearance_mm": 1e3 * min(x.clearance for x in inside),
        "platform_m": float(np.hypot(*np.diff(platform, axis=0).T).sum()),
        "pen_m": float(np.hypot(*np.diff(tip[::10], axis=0).T).sum()),
        "stroke_s": drawing[-1].t - drawing[0].t,
        "wheel_scale": board[-1].wheel_scale if board else None,
    }


def goals(runs: int, seed: int, workers: int, rules: Iterable[str]) -> list[dict[str, Any]]:
    """The rows as ``bench base`` shows them: one a figure, its worst value by fusion rule.

    Args:
        runs: seeds asked for, of which at most ``MOST`` are run: each takes half a minute.
        seed: the first.
        workers: processes side by side.
        rules: by which the platform's votes are fused.
    """
    seeds = range(seed, seed + min(runs, MOST))
    by_rule = {rule: rows(measure(seeds, workers, rule=rule)) for rule in rules}
    out = []
    for made in zip(*by_rule.values(), strict=True):
        worst = {rule: row["worst"] for rule, row in zip(by_rule, made, strict=True)}
        met = {rule: row["met"] for rule, row in zip(by_rule, made, strict=True)}
        about = {key: made[0][key] for key in ("figure", "goal", "least")}
        out.append({**about, "case": CASE, "runs": len(seeds), **worst, "met": met})
    return out


def rows(results: list[Result]) -> list[dict[str, Any]]:
    """One row a case and goal: median and worst over the runs, and whether every run meets it."""
    out = []
    for case in CASES:
        mine = [r for r in results if r["case"] == case]
        if not mine:
            continue
        finished = sum(str(r["outcome"]).startswith("finished") for r in mine)
        for figure, label, bound, least in GOALS:
            if figure == "tracked_rms_mm" and case == WRONG_WHEELS:
                bound = DRIFTING_MM
            values = [float(r[figure]) for r in mine if r[figure] is not None]
            worst = (min(values) if least else max(values)) if values else None
            met = worst is not None and (worst >= bound if least else worst <= bound)
            out.append(
                {
                    "figure": f"3 m line, {case}: {label}",
                    "case": case,
                    "runs": len(values),
                    "finished": finished,
                    "median": median(values) if values else None,
                    "worst": worst,
                    "goal": bound,
                    "least": least,
                    "met": met and finished == len(mine),
                }
            )
    return out
