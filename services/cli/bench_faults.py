"""``steadyhand bench faults``: real services killed, stopped or stuck while the robot draws."""

from __future__ import annotations

import json as jsonlib
import math
import tempfile
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from services.cli.common import Json, console, fail

HEADS = ("fault", "service", "times", "safe [ms]", "its clock", "woken late", "ready [s]", "whole")
"""Of the table; times are medians, with the largest in brackets."""
GOAL = 0.05
"""To be safe after the loss of an input, for 99 of 100 [s]."""


def faults(
    count: Annotated[int, typer.Option(min=1, help="Faults, ten on each robot.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Of what happens when and to whom.")] = 0,
    scenario: Annotated[str, typer.Option(help="What is drawn.")] = "whiteboard_moving",
    json: Json = False,
) -> None:
    """Kill, stop, lock and slow the services of a live robot; nothing else should run meanwhile.

    Exit code 1 if a process is left over, a fault leaves the arm neither at work nor with a reason,
    or what was to be safe or ready again never was.
    """
    from services.faults.processes import campaign

    with tempfile.TemporaryDirectory(prefix="shf") as folder:
        try:
            result = campaign(Path(folder), scenario, seed, count)
        except TimeoutError as error:
            fail(str(error), 1)
    if json:
        typer.echo(jsonlib.dumps(result, indent=2))
    else:
        _show(result)
    raise typer.Exit(0 if _well(result) else 1)


def _well(result: dict[str, Any]) -> bool:
    in_vain = (*result["orphans"].values(), *result["never"].values())
    return all(f["whole"] for f in result["found"]) and not any(in_vain)


def _show(result: dict[str, Any]) -> None:
    from services.faults.processes import PATIENCE

    table = Table(*(head.replace("[", "\\[") for head in HEADS))
    groups = sorted({(f["kind"], f["service"]) for f in result["found"]})
    for kind, service in groups:
        mine = [f for f in result["found"] if (f["kind"], f["service"]) == (kind, service)]
        times = [
            _middle_and_largest(mine, key, scale)
            for key, scale in (("safe", 1e3), ("by_clock", 1e3), ("woken", 1e3), ("ready", 1.0))
        ]
        whole = sum(f["whole"] for f in mine)
        table.add_row(kind, service, str(len(mine)), *times, f"{whole} of {len(mine)}")
    console.print(table)
    console.print(
        f"processes left over: {result['orphans']['ended']} after an orderly end, "
        f"{result['orphans']['killed']} after the supervisor was killed; largest pen force "
        f"{result['force']:.1f} N",
        highlight=False,
    )
    never = result["never"]
    if any(never.values()):
        console.print(
            f"[red]never safe (within {PATIENCE:g} s): {never['safe']}; never ready again: "
            f"{never['ready']}[/]",
            highlight=False,
        )
    if result["safe"] is not None:
        over = max(0.0, result["safe"] - GOAL)
        console.print(
            f"safe after {1e3 * result['safe']:.0f} ms (p99; goal {1e3 * GOAL:.0f}), "
            f"{1e3 * result['safe_by_clock']:.0f} ms by the robot's clock; meanwhile a sleeping "
            f"thread was woken {1e3 * result['noise']:.0f} ms late (p99)"
            + (f", and {1e3 * over:.0f} ms are missed" if over else ""),
            highlight=False,
        )


def _middle_and_largest(found: list[dict[str, Any]], key: str, scale: float) -> str:
    """Median and largest, where what never was is longer than all else; "-" of nothing."""
    awaited = "safe" if key == "by_clock" else key
    times = [math.inf if awaited in f["never"] else f[key] for f in found]
    known = sorted(time for time in times if time is not None)
    if not known:
        return "-"
    return f"{_words(scale * float(np.median(known)))} ({_words(scale * known[-1])})"


def _words(time: float) -> str:
    return "never" if math.isinf(time) else f"{time:.2f}" if time < 10.0 else f"{time:.0f}"
