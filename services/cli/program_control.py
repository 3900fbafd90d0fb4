"""``steadyhand program check --control``: sampled runs instead of a look at the text alone."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import NoReturn

import typer
from rich.progress import track

from arm.hds import Finding, load, render
from arm.nodes import REGISTRY
from deploy.tomlfile import BadFile
from services.cli.common import errors, fail, show_json
from services.programs.control_check import judge
from services.programs.control_check_sample import sample_many, scenario_for
from services.programs.control_check_text import render as render_report
from services.programs.control_check_text import write_replays

REPLAYS = Path("runs") / "control"
"""Where the scenarios of counter-examples go."""


def check_control(
    files: list[Path],
    found: list[Finding],
    samples: int,
    seed: int,
    scenario: str | None,
    json: bool,
    workers: int | None = None,
) -> NoReturn:
    """Print what sampled runs of checked programs say; leave with 1 at a counter-example.

    Args:
        files: programs without errors.
        found: warnings to print with it.
        samples: runs of each program.
        seed: of the first run; those after it count up.
        scenario: to run in, by name or file; None for the one made for the program.
        json: print JSON.
        workers: processes; by default one for each processor.
    """
    if found and not json:
        typer.echo(render(found))
    out, bad = {}, False
    for file in files:
        try:
            world = scenario_for(file, scenario)
        except BadFile as error:
            fail(str(error), 2)
        seeds = range(seed, seed + samples)
        runs = sample_many(world, seeds, workers=workers or os.cpu_count() or 1)
        shown = track(runs, total=samples, description="Sampling", console=errors, disable=json)
        report = judge(load(file, REGISTRY), REGISTRY, shown)
        replays = write_replays(report, world, REPLAYS)
        bad |= bool(report.failed)
        ways = {s: f"steadyhand run {path} --seed {s}" for s, path in replays.items()}
        out[str(file)] = report.as_dict() | {"scenario": world.name, "replays": ways}
        if not json:
            typer.echo(f"{file} in {world.name}, seeds {seed} to {seed + samples - 1}")
            typer.echo(render_report(report, replays))
    if json:
        findings = [dataclasses.asdict(f) for f in found]
        show_json({"ok": not bad, "findings": findings, "control": out})
    raise typer.Exit(1 if bad else 0)
