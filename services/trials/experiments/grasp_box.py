"""Grasps and lifts a box with two arms: sequential, parallel, funnel and sum, pushed or not.

The paper's experiments (Platt et al., section III-B) and larger: ``start = "far"`` is its first,
from 2 m and more, ``start = "front"`` its second, from in front of the box on. ``variant = "all"``
or several impulses make the table of recovery from pushes, ``variant = "pair"`` Fig 8: in sequence
against at once.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from services.trials import grasp_recovery as recovery
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.grasp_figures import figures
from services.trials.grasp_run import Shove, run_trial
from services.trials.lines import Line, middle, share, worst
from sim.scenario import load_scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROGRAMS = {
    ("front", "sequential"): "grasp_refine.hds",
    ("front", "parallel"): "grasp_parallel.hds",
    ("front", "funnel"): "grasp_funnel.hds",
    ("front", "sum"): "grasp_sum.hds",
    ("far", "sequential"): "move_to_grasp.hds",
    ("far", "parallel"): "move_to_grasp_parallel.hds",
}
PAIR = ("sequential", "parallel")
SCENARIOS = {"front": "reach_to_grasp", "far": "move_to_grasp"}
Impulse = Annotated[float, Field(ge=0.0, le=400.0)]


class Options(Base):
    """What may be chosen."""

    variant: Literal["sequential", "parallel", "funnel", "sum", "pair", "all"] = "sequential"
    """``pair``: in sequence and at once, from the same start."""
    start: Literal["front", "far"] = "front"
    push: Literal["none", "arm", "base", "box"] = "none"
    phase: Literal["reach", "touch", "grip", "lift"] = "grip"
    impulse: Impulse | tuple[Impulse, ...] = 0.0
    """Of the push, over 0.1 s [N s]; with several, each in turn."""
    hold: float = Field(default=5.0, gt=0.0, le=5.0)
    """How long the box is held [s]."""

    @model_validator(mode="after")
    def _possible(self) -> Options:
        sizes = self.impulse if isinstance(self.impulse, tuple) else (self.impulse,)
        if self.table and (self.push == "none" or self.start == "far"):
            raise ValueError("several variants or impulses are of a push, with start=front")
        if self.variant == "pair" and self.table:
            raise ValueError("a pair is under one push; variant=all makes the table")
        if not self.table and self.variant != "pair" and (self.start, self.variant) not in PROGRAMS:
            known = ", ".join(f"start={s} variant={v}" for s, v in PROGRAMS)
            raise ValueError(f"no program for start={self.start} variant={self.variant}: {known}")
        if any((self.push == "none") != (size == 0.0) for size in sizes) or not sizes:
            raise ValueError("a push has an impulse, and none has none")
        return self

    @property
    def table(self) -> bool:
        """Whether a trial is of more than one variant or size."""
        return self.variant == "all" or isinstance(self.impulse, tuple)


def run(seed: int, options: Options) -> Row:
    """One trial in lockstep, and its figures; of a pair those of both, of a table every cell."""
    sizes = options.impulse if isinstance(options.impulse, tuple) else (options.impulse,)
    if options.variant == "pair":
        return {variant: _one(seed, options, variant, sizes[0]) for variant in PAIR}
    if not options.table:
        return _one(seed, options, options.variant, sizes[0])
    variants = recovery.VARIANTS if options.variant == "all" else (options.variant,)
    return {"cells": recovery.cells(variants, sizes, partial(_one, seed, options))}


def _one(seed: int, options: Options, variant: str, impulse: float) -> Row:
    scenario = load_scenario(SCENARIOS[options.start])
    program = PROGRAMS[options.start, variant]
    task = scenario.task.model_copy(update={"program": program})
    scenario = scenario.model_copy(update={"task": task})
    shove = None
    if options.push != "none":
        shove = Shove(options.push, options.phase, impulse)
    return figures(run_trial(scenario, seed, options.hold, shove))


def summary(rows: list[Row]) -> list[Line]:
    """How often it lifted the box, how fast, how smoothly, and how well it knew where it was."""
    if rows and "cells" in rows[0]:
        return recovery.table(rows)
    if rows and PAIR[0] in rows[0]:
        return pair_summary(rows)
    stood = [row for row in rows if not row["off_table"]]
    lines = [
        share("lifted and held", (row["success"] for row in rows), goal=0.99),
        share("lifted, of those left on the table", (row["success"] for row in stood)),
        share("box off the table", (row["off_table"] for row in rows), least=False),
        middle("reach to comply [s]", (row["grasp_s"] for row in rows)),
        middle("jerk of the palms, rms [m/s^3]", (row["jerk_rms"] for row in rows)),
        worst("tilt [deg]", (row["tilt_deg"] for row in rows), goal=2.0),
        worst("tilt at the end [deg]", (row["tilt_end_deg"] for row in rows)),
        worst("slip [mm]", (row["slip_mm"] for row in rows), goal=1.0),
        worst("palm force, peak [N]", (row["peak_force_n"] for row in rows), goal=100.0),
        middle("palm force, peak [N]", (row["peak_force_n"] for row in rows)),
        middle("NEES of the box, six degrees", (row["nees"] for row in stood), statistic=np.mean),
        middle("simulated [s]", (row["simulated_s"] for row in rows)),
    ]
    return lines + variance_lines(stages(rows))


def pair_summary(rows: list[Row]) -> list[Line]:
    """What doing it at once gains, seed by seed, and the figures of both."""
    both = [(row[PAIR[0]], row[PAIR[1]]) for row in rows]
    lines = [
        middle("time, in sequence / at once", ratios(both, "grasp_s"), goal=1.5, least=True),
        middle("jerk, in sequence / at once", ratios(both, "jerk_rms"), goal=1.0, least=True),
    ]
    for name in PAIR:
        for line in summary([row[name] for row in rows]):
            lines.append(replace(line, label=f"{name}: {line.label}"))
    return lines


def ratios(both: list[tuple[Row, Row]], figure: str) -> list[float]:
    """Of a figure, first to second, of the pairs in which both lifted the box."""
    lifted = [(a, b) for a, b in both if a["success"] and b["success"]]
    return [a[figure] / b[figure] for a, b in lifted]


def variance_lines(by_stage: dict[str, np.ndarray]) -> list[Line]:
    """Fig 7 in numbers: variance of the box pose by stage, of the error and as stated."""
    lines = []
    goal = 10.0 if "front" in by_stage else None  # from far; before the box it is known already
    axes = (("x", "mm^2"), ("y", "mm^2"), ("yaw", "mrad^2"))
    for i, (axis, unit) in enumerate(axes):
        for what, column in (("variance", i), ("stated variance", i + 3)):
            for name, values in by_stage.items():
                label = f"{what} of {axis} at {name} [{unit}]"
                lines.append(middle(label, values[:, column], statistic=_mean_square))
        found = list(by_stage.values())
        if len(found) > 1:
            stated = np.array([_mean_square(v[:, i + 3]) for v in found])
            falls = float(stated[0] / stated[-1])
            grows = float((stated[1:] / stated[:-1]).max())
            n = min(len(v) for v in found)
            lines += [
                Line(f"fall of {axis}, as stated, in all", falls, None, None, n, goal, True),
                Line(
                    f"largest growth of {axis} over a stage, as stated", grows, None, None, n, 1.0
                ),
            ]
    return lines


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """Figs 4, 6, 7 and 8 of the paper, from these trials."""
    from services.reports.style import save
    from services.trials import grasp_pictures as draw

    if "cells" in rows[0]:
        return save(folder, [("recovery", recovery.picture(rows))])
    if rows and PAIR[0] in rows[0]:
        by_name = {name: [row[name] for row in rows] for name in PAIR}
        found = [
            (f"{title}_{name}", figure)
            for name, mine in by_name.items()
            for title, figure in _drawn(mine)
        ]
    else:
        by_name = {"": rows}
        found = _drawn(rows)
    lifted = {name: [row for row in mine if row["success"]][:9] for name, mine in by_name.items()}
    if all(lifted.values()):
        found.append(("fig8_palm_paths", draw.palm_paths(lifted)))
    return save(folder, found)


def _drawn(rows: list[Row]) -> list[tuple[str, Figure | None]]:
    """Figs 4, 6 and 7, of one variant."""
    from services.trials import grasp_pictures as draw

    lifted: list[dict[str, Any]] = [row for row in rows if row["success"]]
    return [
        ("fig4_palms", draw.palms(lifted[0]) if lifted else None),
        ("fig6_base_and_palms", draw.overhead(lifted[:8]) if lifted else None),
        ("fig7_variance", draw.variances(stages(rows)) if stages(rows) else None),
    ]


def stages(rows: list[Row]) -> dict[str, np.ndarray]:
    """By stage, of every trial that came there: error x, y, yaw, and stated deviations, (n, 6)."""
    names = list(dict.fromkeys(name for row in rows for name in row["stages"]))
    return {
        name: np.array([row["stages"][name] for row in rows if name in row["stages"]])
        for name in names
    }


def _mean_square(values: np.ndarray, axis: int = -1) -> np.ndarray:
    return np.mean(np.square(values), axis=axis)
