"""Runs the observer's benchmark: worlds over seeds, estimators on each, side by side."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product

from observer.bench.estimators import ESTIMATORS, REFERENCE
from observer.bench.motions import DURATION, MOTIONS
from observer.bench.play import Track
from observer.bench.rows import Key
from observer.bench.score import Score, judge
from observer.bench.world import World

TUNING = 200
"""Seeds below this were used to choose constants; figures come from others."""


Outcome = list[tuple[Key, Score]]
"""Of one world: how each estimator did."""


@dataclass(frozen=True)
class Plan:
    """What is asked for.

    Attributes:
        motions: names of `MOTIONS`.
        rates: of odometry [Hz].
        estimators: names of `ESTIMATORS`; the reference is run in any case.
        seed: first one.
        runs: number of worlds per motion and rate.
        duration: of a run [s].
    """

    motions: tuple[str, ...] = tuple(MOTIONS)
    rates: tuple[float, ...] = (20.0, 10.0, 5.0)
    estimators: tuple[str, ...] = tuple(ESTIMATORS)
    seed: int = 1000
    runs: int = 10
    duration: float = DURATION

    @property
    def all_estimators(self) -> tuple[str, ...]:
        """Those asked for, and the reference, in the order of the table."""
        return tuple(n for n in ESTIMATORS if n in self.estimators or n == REFERENCE)


@dataclass(frozen=True)
class Job:
    """One world and who is to follow it."""

    motion: str
    rate: float
    seed: int
    estimators: tuple[str, ...]
    duration: float


def jobs(plan: Plan) -> list[Job]:
    """Every world of a plan."""
    seeds = range(plan.seed, plan.seed + plan.runs)
    return [
        Job(motion, rate, seed, plan.all_estimators, plan.duration)
        for rate, motion, seed in product(plan.rates, plan.motions, seeds)
    ]


def measure(
    plan: Plan, workers: int, watch: Callable[[Iterable[Outcome]], Iterable[Outcome]] = iter
) -> dict[Key, Score]:
    """Run a plan; what is kept does not grow with the number of runs, but for a few numbers.

    Args:
        plan: what to run.
        workers: processes side by side; the cost of a step is only worth something with one.
        watch: told of every world that is done, for showing progress.
    """
    scores = {
        Key(motion, rate, name): Score()
        for rate, motion, name in product(plan.rates, plan.motions, plan.all_estimators)
    }
    with ProcessPoolExecutor(max_workers=workers) as pool:
        for outcome in watch(pool.map(run_job, jobs(plan))):
            for key, score in outcome:
                scores[key].merge(score)
    return scores


def run_job(job: Job) -> Outcome:
    """Follow one world with every estimator asked for."""
    world = MOTIONS[job.motion].world(job.seed, job.rate, job.duration)
    return [(Key(job.motion, job.rate, name), _score(name, world)) for name in job.estimators]


def _score(name: str, world: World) -> Score:
    estimator = ESTIMATORS[name]
    track, garbage = _as_live(lambda: estimator.follow(world, time.perf_counter))
    score = judge(track, world, estimator.detects)
    if estimator.make is not None:
        score.values["garbage_per_tick"] = [garbage / len(track.index)]
    return score


def _as_live(follow: Callable[[], Track]) -> tuple[Track, int]:
    """Run as a live loop does, without collector; count what it would have had to collect.

    With the collector on, the benchmark's own objects would be searched inside the steps measured.
    That it is off hides no cost as long as next to no garbage is found afterwards.
    """
    gc.collect()
    gc.disable()
    try:
        track = follow()
    finally:
        found = gc.collect()
        gc.enable()
    return track, found
