"""Draws on the whiteboard from a moving platform, in lockstep: the line, the force, the estimate.

The figures of a run are those of ``steadyhand run``; what depends on the machine is left out.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, field_validator

from services.run import Run, run_lockstep, write, write_report
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.lines import Line, middle, share, worst
from sim.scenario import load_scenario

MACHINE = ("realtime_factor", "processor_s")
FIGURES = {
    "contour error, rms [mm]": "line_rms_mm",
    "force error over 20 ms, rms [N]": "force_rms_error_n",
    "estimate error, rms [mm]": "estimate_rms_mm",
}


class Options(Base):
    """What may be chosen."""

    scenario: str = "whiteboard_moving"
    observer: Literal["ekf", "taylor", "hold", "truth"] = "ekf"
    seconds: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    """Instead of the scenario's limit [s]."""

    @field_validator("scenario")
    @classmethod
    def _is_ours(cls, name: str) -> str:
        if name.endswith(".toml") or "/" in name:
            raise ValueError("a scenario of this project by name: a file may change unnoticed")
        load_scenario(name)  # says which there are
        return name


def run(seed: int, options: Options) -> Row:
    """One lockstep run, and its figures."""
    return _row(_run(seed, options))


def show(seed: int, options: Options, folder: Path) -> Row:
    """The same run, with its log and pictures."""
    done = _run(seed, options)
    row = _row(done)
    write(done, folder)
    title = f"{options.scenario}, observer {options.observer}, seed {seed}"
    write_report(done.log, done.result, folder, title)
    return row


def summary(rows: list[Row]) -> list[Line]:
    """How often it finished, and the figures of the drawing."""
    return [
        share("finished", (row["outcome"].startswith("finished") for row in rows), goal=1.0),
        *(middle(label, (row[key] for row in rows)) for label, key in FIGURES.items()),
        worst("contour error, largest of all [mm]", (row["line_max_mm"] for row in rows)),
        middle("pen on the board while drawing", _contact(rows), least=True),
        middle("simulated [s]", (row["simulated_s"] for row in rows)),
    ]


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """Distributions of the figures over the trials."""
    from services.reports.style import save
    from services.trials.plots import distributions

    values = {
        label: [row[key] for row in rows if row[key] is not None] for label, key in FIGURES.items()
    }
    lines = {line.label: line for line in summary(rows)}
    shown = {label: mine for label, mine in values.items() if mine}
    return save(folder, [("figures", distributions(shown, lines) if shown else None)])


def _contact(rows: list[Row]) -> list[float | None]:
    return [row["contact_fraction"] for row in rows]


def _run(seed: int, options: Options) -> Run:
    return run_lockstep(
        load_scenario(options.scenario), seed, options.observer, duration=options.seconds
    )


def _row(done: Run) -> Row:
    return {key: value for key, value in done.result.items() if key not in MACHINE}
