"""Grasps and lifts a box with two arms: sequential, parallel, funnel and sum, pushed or not.

The paper's experiments (Platt et al., section III-B) and larger: ``start = "far"`` is its first,
from 2 m and more, ``start = "front"`` its second, from in front of the box on.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.grasp_figures import figures
from services.trials.grasp_run import Shove, run_trial
from services.trials.lines import Line, middle, share, worst
from sim.scenario import load_scenario

PROGRAMS = {
    ("front", "sequential"): "grasp_refine.hds",
    ("front", "parallel"): "grasp_parallel.hds",
    ("front", "funnel"): "grasp_funnel.hds",
    ("front", "sum"): "grasp_sum.hds",
    ("far", "sequential"): "move_to_grasp.hds",
    ("far", "parallel"): "move_to_grasp_parallel.hds",
}
SCENARIOS = {"front": "reach_to_grasp", "far": "move_to_grasp"}
LIMITS = {"arm": 80.0, "base": 300.0, "box": 5.0, "none": 0.0}
"""Largest push of the experiment [N s]."""


class Options(Base):
    """What may be chosen."""

    variant: Literal["sequential", "parallel", "funnel", "sum"] = "sequential"
    start: Literal["front", "far"] = "front"
    push: Literal["none", "arm", "base", "box"] = "none"
    phase: Literal["reach", "touch", "grip", "lift"] = "grip"
    impulse: float = Field(default=0.0, ge=0.0, le=400.0)
    """Of the push, over 0.1 s [N s]."""
    hold: float = Field(default=5.0, gt=0.0, le=5.0)
    """How long the box is held [s]."""

    @model_validator(mode="after")
    def _possible(self) -> Options:
        if (self.start, self.variant) not in PROGRAMS:
            known = ", ".join(f"start={s} variant={v}" for s, v in PROGRAMS)
            raise ValueError(f"no program for start={self.start} variant={self.variant}: {known}")
        if (self.push == "none") != (self.impulse == 0.0):
            raise ValueError("a push has an impulse, and none has none")
        return self


def run(seed: int, options: Options) -> Row:
    """One trial in lockstep, and its figures."""
    scenario = load_scenario(SCENARIOS[options.start])
    program = PROGRAMS[options.start, options.variant]
    task = scenario.task.model_copy(update={"program": program})
    scenario = scenario.model_copy(update={"task": task})
    shove = None
    if options.push != "none":
        shove = Shove(options.push, options.phase, options.impulse)
    return figures(run_trial(scenario, seed, options.hold, shove))


def summary(rows: list[Row]) -> list[Line]:
    """How often it lifted the box, how fast, how smoothly, and how well it knew where it was."""
    stood = [row for row in rows if not row["off_table"]]
    lines = [
        share("lifted and held", (row["success"] for row in rows), goal=0.99),
        share("lifted, of those left on the table", (row["success"] for row in stood)),
        share("box off the table", (row["off_table"] for row in rows), least=False),
        middle("reach to comply [s]", (row["grasp_s"] for row in rows)),
        middle("jerk of the palms, rms [m/s^3]", (row["jerk_rms"] for row in rows)),
        worst("tilt [deg]", (row["tilt_deg"] for row in rows), goal=2.0),
        worst("slip [mm]", (row["slip_mm"] for row in rows), goal=1.0),
        worst("palm force, peak [N]", (row["peak_force_n"] for row in rows), goal=100.0),
        middle("palm force, peak [N]", (row["peak_force_n"] for row in rows)),
        middle("NEES of the box, six degrees", (row["nees"] for row in stood), statistic=np.mean),
        middle("simulated [s]", (row["simulated_s"] for row in rows)),
    ]
    for name, values in stages(rows).items():
        for i, axis in enumerate(("x", "y")):
            label = f"variance at {name}, {axis} [mm^2]"
            lines.append(middle(label, values[:, i].tolist(), statistic=_mean_square))
    return lines


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """Figs 4, 6, 7 and 8 of the paper, from these trials."""
    from services.reports.report import save
    from services.trials import grasp_pictures as draw

    lifted: list[dict[str, Any]] = [row for row in rows if row["success"]]
    return save(
        folder,
        [
            ("fig4_palms", draw.palms(lifted[0]) if lifted else None),
            ("fig6_base_and_palms", draw.overhead(lifted[:8]) if lifted else None),
            ("fig7_variance", draw.variances(stages(rows)) if stages(rows) else None),
            ("fig8_palm_paths", draw.palm_paths(lifted[:9]) if lifted else None),
        ],
    )


def stages(rows: list[Row]) -> dict[str, np.ndarray]:
    """By stage, of every trial that came there: error x, y, yaw, and stated deviations, (n, 6)."""
    names = list(dict.fromkeys(name for row in rows for name in row["stages"]))
    return {
        name: np.array([row["stages"][name] for row in rows if name in row["stages"]])
        for name in names
    }


def _mean_square(values: np.ndarray, axis: int = -1) -> np.ndarray:
    return np.mean(np.square(values), axis=axis)
