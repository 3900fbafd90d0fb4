"""``steadyhand bench page``: how soon the robot is on the page, and how often it moves."""

from __future__ import annotations

import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from services.cli.common import Json, console, fail, show_json


def page(
    seconds: Annotated[float, typer.Option(min=2.0, help="How long to look.")] = 10.0,
    scenario: Annotated[str, typer.Option(help="What is drawn.")] = "whiteboard_moving",
    json: Json = False,
) -> None:
    """Time what a page of a live robot gets over its line; no browser draws.

    Exit code 1 if a goal is missed.
    """
    from services.bench.page import FIRST, RATE, measure
    from services.script import Silent

    with tempfile.TemporaryDirectory(prefix="shp") as folder:
        try:
            found = measure(Path(folder) / "r", scenario, seconds)
        except (Silent, TimeoutError) as error:
            fail(str(error))
    if json:
        show_json({**asdict(found), "met": found.met})
    else:
        table = Table("page", "", "goal")
        table.add_row("ready after the services \\[s]", f"{found.ready:.2f}", "")
        table.add_row("then the robot's shapes after \\[s]", f"{found.first:.2f}", f"≤ {FIRST:g}")
        table.add_row("pictures a second", f"{found.rate:.1f}", f"≥ {RATE:g}")
        table.add_row("longest between two \\[s]", f"{found.longest:.3f}", "")
        table.add_row("kB/s", f"{found.bytes_per_s / 1e3:.0f}", "")
        console.print(table)
    raise typer.Exit(0 if found.met else 1)
