"""An arm with a hand fetches a bottle from a moving platform: how often, how still, how exactly.

``frame=platform`` leaves the observer out while the platform goes to and fro; ``observer=hold`` and
others show what a worse estimate does.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Literal

from pydantic import Field

from deploy.task import PROGRAMS
from services.reports.bottle import BOTTLE_FIGURES
from services.run import run_lockstep
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.lines import Line, middle, share, worst
from sim.scenario import Scenario, load_scenario


class Options(Base):
    """What may be chosen."""

    observer: Literal["ekf", "truth", "taylor", "hold"] = "ekf"
    frame: Literal["ground", "platform"] = "ground"
    thing: Literal["bottle", "roll"] = "bottle"
    scatter: float = Field(default=0.01, ge=0.0, le=0.1)
    """Of the bottle about where it is believed to be [m]."""
    mass: float = Field(default=0.5, gt=0.0, le=3.0)
    """[kg]"""
    inertia: float = Field(default=0.0, ge=0.0, le=0.2)
    """By which masses and moments of arm and hand differ from what they believe."""


def run(seed: int, options: Options) -> Row:
    """One trial in lockstep, and its figures."""
    with tempfile.TemporaryDirectory() as folder:
        done = run_lockstep(scenario_of(options, Path(folder)), seed, options.observer)
    names = ("placed", "outcome", "simulated_s", "processor_s", "estimate_rms_mm", *BOTTLE_FIGURES)
    row = {name: done.result.get(name) for name in names}
    return {**row, "success": done.result["placed"]}


def scenario_of(options: Options, folder: Path) -> Scenario:
    """The scenario with the options; a program that differs is written to ``folder``."""
    scenario = load_scenario("pick_bottle")
    world, task = scenario.world, scenario.task
    assert world.bottle is not None
    changed = {"thing": options.thing, "scatter": options.scatter, "mass": options.mass}
    mismatch = world.mismatch.model_copy(update={"inertia": options.inertia})
    bottle = world.bottle.model_copy(update=changed)
    world = world.model_copy(update={"bottle": bottle, "mismatch": mismatch})
    if options.frame != "ground":
        text = (PROGRAMS / task.program).read_text()
        node = "TYPE = Hand_stay;"
        assert node in text
        file = folder / task.program
        file.write_text(text.replace(node, f"{node}\n    Frame = {options.frame};"))
        task = task.model_copy(update={"program": str(file)})
    return scenario.model_copy(update={"world": world, "task": task})


def summary(rows: list[Row]) -> list[Line]:
    """How often it was placed, how exactly, how still the hand was."""
    carried = [row for row in rows if row["carried_slip_mm"] is not None]
    stayed = [row for row in rows if row["still_rms_mm"] is not None]
    placed = [row for row in rows if row["placed"]]
    return [
        share("placed upright at the goal", (row["placed"] for row in rows)),
        share("lifted", (row["carried_slip_mm"] is not None for row in rows)),
        worst("reaches", (row["tries"] for row in rows)),
        middle("from the goal [mm]", (row["placed_error_mm"] for row in placed)),
        worst("from the goal [mm]", (row["placed_error_mm"] for row in placed)),
        worst("tilt where placed [deg]", (row["placed_tilt_deg"] for row in placed)),
        worst("tilt while carried [deg]", (row["carried_tilt_deg"] for row in carried)),
        worst("moved in the hand while carried [mm]", (row["carried_slip_mm"] for row in carried)),
        worst("force on a fingertip [N]", (row["tip_force_peak_n"] for row in rows), goal=80.0),
        middle("hand in the world, rms [mm]", (row["still_rms_mm"] for row in stayed)),
        worst("hand in the world, largest [mm]", (row["still_max_mm"] for row in stayed)),
        middle("hand in the world, rms [deg]", (row["still_rms_deg"] for row in stayed)),
        middle("platform meanwhile, way across [mm]", (row["still_platform_mm"] for row in stayed)),
        middle("platform meanwhile, turn [deg]", (row["still_platform_deg"] for row in stayed)),
        middle("simulated [s]", (row["simulated_s"] for row in rows)),
    ]


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """None: a run of ``steadyhand run pick_bottle`` has them."""
    return []
