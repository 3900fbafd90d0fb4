"""``steadyhand bench arm``: the figures the arm's control stands by, and whether they are met."""

from __future__ import annotations

import json as jsonlib
import re
from statistics import median
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.progress import track
from rich.table import Table

from services.bench import arm as arm_bench
from services.cli.common import Json, console, fail


def arm(
    seeds: Annotated[str, typer.Option(help="First and last seed.")] = "100-109",
    workers: Annotated[int, typer.Option(help="Runs side by side; 1 to measure speed.")] = 1,
    json: Json = False,
) -> None:
    """Drawing, light contact, late commands, stiffness and cost, with the goals they are to reach.

    A goal is met if every run meets it.
    """
    match = re.fullmatch(r"(\d+)(?:-(\d+))?", seeds)
    if match is None or int(match[2] or match[1]) < int(match[1]):
        fail(f"--seeds takes a number or first-last, like 100-109, not {seeds!r}", 2)
    chosen = range(int(match[1]), int(match[2] or match[1]) + 1)
    total = len(chosen) * len(arm_bench.CASES)
    results = arm_bench.measure(
        chosen, workers, lambda done: track(done, total=total, disable=json, console=console)
    )
    rows = summary(results)
    if json:
        typer.echo(jsonlib.dumps(rows, indent=2))
        return
    table = Table("", "median", "worst", "goal", "", title=f"arm, seeds {seeds}")
    for row in rows:
        sign = "-" if row["goal"] is None else ("≥ " if row["least"] else "≤ ") + f"{row['goal']:g}"
        verdict = {True: "[green]met[/]", False: "[red]missed[/]", None: ""}[row["met"]]
        figures = [f"{row[key]:.3g}" if row["runs"] else "-" for key in ("median", "worst")]
        table.add_row(escape(row["figure"]), *figures, sign, verdict)
    console.print(table)
    unfinished = [f"{r['case']}, seed {r['seed']}: {r['outcome']}" for r in results if _failed(r)]
    for line in unfinished:
        console.print(escape(line))


def summary(results: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row a goal: median and worst over the runs, and whether all of them meet it."""
    rows = []
    for goal in arm_bench.GOALS:
        mine = [r for r in results if r["case"] == goal.case]
        values = [r[goal.figure] for r in mine if r.get(goal.figure) is not None]
        met = goal.met(values)
        rows.append(
            {
                "figure": goal.label,
                "case": goal.case,
                "runs": len(values),
                "median": median(values) if values else None,
                "worst": goal.worst(values) if values else None,
                "goal": goal.bound,
                "least": goal.least,
                "met": None if met is None else met and not any(map(_failed, mine)),
            }
        )
    return rows


def _failed(result: dict[str, Any]) -> bool:
    return not str(result["outcome"]).startswith(("finished", "running"))
