"""``steadyhand bench approach``: the approach policy from many starts, and Table II as printed."""

from __future__ import annotations

import json as jsonlib
from typing import Annotated

import typer
from rich.progress import track
from rich.table import Table

from services.bench import approach as approach_bench
from services.cli.common import Json, console

HEADS = {
    "starts": "starts",
    "arrived": "arrived",
    "median_s": "median [s]",
    "slowest_s": "slowest [s]",
    "furthest_m": "furthest [m]",
    "worst_deg": "worst angle [deg]",
    "switches": "switches",
}


def approach(
    starts: Annotated[int, typer.Option(min=1, help="Of each policy.")] = approach_bench.STARTS,
    seed: Annotated[int, typer.Option(min=0, help="Of the first start.")] = 1000,
    workers: Annotated[int, typer.Option(min=1, help="Runs side by side.")] = 1,
    json: Json = False,
) -> None:
    """Approach an object from 2 to 2.5 m away: how many arrive, and when.

    Exit code 1 if a start of the corrected policy does not arrive.
    """
    total = len(approach_bench.jobs(starts, seed))
    rows = approach_bench.rows(
        starts,
        seed,
        workers,
        lambda done: track(done, total=total, disable=json, console=console),
    )
    if json:
        typer.echo(jsonlib.dumps(rows, indent=2))
    else:
        table = Table("", *(head.replace("[", "\\[") for head in HEADS.values()))
        for row in rows:
            cells = ["-" if row[key] is None else f"{row[key]:.4g}" for key in HEADS]
            table.add_row(str(row["policy"]), *cells)
        console.print(table)
    good = all(row["arrived"] == 1.0 for row in rows if row["policy"].startswith("approach"))
    raise typer.Exit(0 if good else 1)
