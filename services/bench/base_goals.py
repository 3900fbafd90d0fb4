"""What the platform's bench is to reach, figure by figure."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from services.bench.base import Result


@dataclass(frozen=True)
class Goal:
    """A figure over all runs of a case, and the most (or least) it may be.

    Attributes:
        label: as people read it.
        case: one of ``CASES``.
        figure: of its results.
        over: how the runs are made one number: one of ``OVER``.
        bound: None if there is nothing it must reach.
        least: the bound is a lower one.
    """

    label: str
    case: str
    figure: str
    over: str
    bound: float | None = None
    least: bool = False

    def value(self, results: Iterable[Result]) -> float | None:
        """Of the results of this case and one rule; None if there is none."""
        values = [r[self.figure] for r in results if r["case"] == self.case]
        known = [float(v) for v in values if v is not None]
        return OVER[self.over](known) if known else None

    def met(self, value: float | None) -> bool | None:
        """Whether the value is good enough; None if there is nothing to reach."""
        if self.bound is None or value is None:
            return None
        slack = 1e-6 * abs(self.bound)
        return value >= self.bound - slack if self.least else value <= self.bound + slack


OVER: dict[str, Callable[[list[float]], float]] = {
    "share": lambda v: sum(v) / len(v),
    "sum": sum,
    "max": max,
    "min": min,
    "median": lambda v: float(np.median(v)),
}
GOALS = (
    Goal("clutter: arrive [share]", "clutter", "arrived", "share", 0.99, least=True),
    Goal("clutter: collisions", "clutter", "collided", "sum", 0),
    Goal("clutter: way over the shortest, worst", "clutter", "length_ratio", "max", 1.3),
    Goal("clutter: way within 1.3 of the shortest [share]", "clutter", "direct", "share"),
    Goal("clutter: way over the shortest, median", "clutter", "length_ratio", "median"),
    Goal("clutter: clearance, smallest [mm]", "clutter", "clearance_mm", "min"),
    Goal("clutter: time, median [s]", "clutter", "time_s", "median"),
    Goal("clutter: swings a minute, median", "clutter", "swings_per_min", "median"),
    Goal("clutter: swings a minute, worst", "clutter", "swings_per_min", "max"),
    Goal("crossing: collisions", "crossing", "collided", "sum", 0),
    Goal("crossing: arrive [share]", "crossing", "arrived", "share"),
    Goal("crossing: clearance, smallest [mm]", "crossing", "clearance_mm", "min"),
    Goal("doorway: arrive [share]", "doorway", "arrived", "share", 0.99, least=True),
    Goal("corridor: arrive [share]", "corridor", "arrived", "share", 0.99, least=True),
    Goal("dock: by its own sensors, worst [mm]", "dock", "own_mm", "max", 5.0),
    Goal("dock: by its own sensors, worst [deg]", "dock", "own_deg", "max", 0.3),
    Goal("dock: in truth, worst [mm]", "dock", "true_mm", "max"),
    Goal("dock: in truth, worst [deg]", "dock", "true_deg", "max"),
    Goal("position: by its own sensors, worst [mm]", "position", "own_mm", "max", 5.0),
    Goal("position: by its own sensors, worst [deg]", "position", "own_deg", "max", 0.3),
    *(
        Goal(f"{case}: command {what}, worst [of limit]", case, f"{what}_of_limit", "max", 1.0)
        for case in ("clutter", "crossing")
        for what in ("acceleration", "jerk")
    ),
    Goal("clutter: a step, median [ms]", "clutter", "step_ms", "median", 2.0),
    Goal("clutter: a step at a new scan, median [ms]", "clutter", "scan_ms", "median", 3.0),
    Goal("dock: a step at a new scan, median [ms]", "dock", "scan_ms", "median", 3.0),
    Goal("position: a step at a new scan, median [ms]", "position", "scan_ms", "median", 1.0),
)
