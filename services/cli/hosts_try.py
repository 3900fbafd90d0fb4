"""``steadyhand hosts try``: what the network between hosts does to the drawing, in lockstep."""

from __future__ import annotations

import math
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import typer
from rich.table import Table

from services.cli.common import Json, console, fail, show_json

GOAL = 1.0
"""From the intended line, on bad links [mm rms]."""


def try_(
    file: Annotated[Path, typer.Argument(help="Hosts file: a path, or a name: three.")],
    scenario: Annotated[str, typer.Option(help="Instead of the file's.")] = "",
    seeds: Annotated[int, typer.Option(min=1, help="How many runs.")] = 3,
    first: Annotated[int, typer.Option(min=0, help="Seed of the first.")] = 100,
    cut: Annotated[str, typer.Option(help="Besides, take this host off the network.")] = "",
    at: Annotated[float, typer.Option(help="When [s].")] = 8.0,
    cut_for: Annotated[float, typer.Option(help="For how long [s].")] = 1.0,
    json: Json = False,
) -> None:
    """Draw while each message between hosts is late, jittered and lost as the file's link says.

    On simulated time, so that the machine has no part in it; somebody resumes what waits. As with
    datagrams, no message waits for one that was lost. Exit code 1 if a run did not finish.
    """
    from deploy.host_file import load_hosts
    from deploy.tomlfile import BadFile
    from services.faults.links import bad_links, partition
    from services.faults.run import run_faulty
    from services.reports.evaluation import figures_of
    from sim.scenario import load_scenario

    try:
        places = load_hosts(file)
        loaded = load_scenario(scenario or places.scenario)
    except BadFile as error:
        fail(str(error), 2)
    if cut and cut not in places.host:
        fail(f"no host {cut!r}. Known: {', '.join(places.host)}", 2)
    faults = bad_links(places, loaded.duration)
    faults += partition(places, cut, at, cut_for) if cut else []
    rows: list[dict[str, Any]] = []
    for seed in range(first, first + seeds):
        done = run_faulty(loaded, seed, faults, [], keep=True)
        assert done.log is not None
        row = {key: done.row[key] for key in ("seed", "end", "finished", "resumed")}
        rms = figures_of(done.log).get("line_rms_mm")
        safe = [*done.row["safe_after_s"], *(math.inf for _ in range(done.row["never_safe"]))]
        rows.append({**row, "safe_s": max(safe, default=None), "rms_mm": rms})
        if not json:
            console.print(f"seed {seed}: {row['end']}", highlight=False)
    if json:
        show_json(rows)
    else:
        _show(rows)
    raise typer.Exit(0 if all(row["finished"] for row in rows) else 1)


def _show(rows: list[dict[str, Any]]) -> None:
    table = Table("seed", "finished", "resumed", "safe after \\[s]", "from the line, rms \\[mm]")
    for row in rows:
        known = ["-" if row[key] is None else f"{row[key]:.3f}" for key in ("safe_s", "rms_mm")]
        table.add_row(str(row["seed"]), str(row["finished"]), str(row["resumed"]), *known)
    console.print(table)
    drawn = [row["rms_mm"] for row in rows if row["rms_mm"] is not None]
    if drawn:
        met = "met" if max(drawn) <= GOAL else "MISSED"
        console.print(
            f"median {median(drawn):.2f} mm, worst {max(drawn):.2f} mm (goal {GOAL:g} mm: {met})",
            highlight=False,
        )
