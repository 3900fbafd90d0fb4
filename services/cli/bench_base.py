"""``steadyhand bench base``: what the platform reaches among obstacles, by fusion rule."""

from __future__ import annotations

import json as jsonlib
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.progress import track
from rich.table import Table

from services.bench import approach as approach_bench
from services.bench import base as base_bench
from services.bench import line as line_bench
from services.bench.base_goals import GOALS
from services.cli.common import Json, console, fail


def base(
    seeds: Annotated[str, typer.Option(help="First and last seed of the worlds.")] = "1000-1199",
    cases: Annotated[str, typer.Option(help="Of the cases, comma-separated; all if empty.")] = "",
    rules: Annotated[str, typer.Option(help="Fusion rules, comma-separated.")] = "optimum,weighted",
    workers: Annotated[int, typer.Option(min=1, help="Runs side by side; 1 for speed.")] = 1,
    json: Json = False,
) -> None:
    """Clutter, people who cross, doors, docking and positioning, with the goals of each.

    Cases other than clutter take the first half of the seeds. Seeds from 1000 on are not used for
    tuning.
    """
    match = re.fullmatch(r"(\d+)(?:-(\d+))?", seeds)
    if match is None or int(match[2] or match[1]) < int(match[1]):
        fail(f"--seeds takes a number or first-last, like 1000-1199, not {seeds!r}", 2)
    numbers = range(int(match[1]), int(match[2] or match[1]) + 1)
    chosen = _names(cases, "--cases", (*base_bench.CASES, approach_bench.CASE, line_bench.CASE))
    by = _names(rules, "--rules", base_bench.RULES)
    jobs = [
        base_bench.Job(case, rule, seed)
        for case in chosen
        if case in base_bench.CASES
        for rule in by
        for seed in (numbers if case == "clutter" else numbers[: (len(numbers) + 1) // 2])
    ]
    results: list[dict[str, Any]] = []
    rows: list[dict[str, Any]] = []
    stopped = False

    def keep(done: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
        for result in track(done, total=len(jobs), disable=json, console=console):
            results.append(result)
            yield result

    try:
        base_bench.measure(jobs, workers, keep)
        if approach_bench.CASE in chosen:
            rows += approach_bench.goals(len(numbers), numbers[0], workers, by)
        if line_bench.CASE in chosen:
            rows += line_bench.goals(len(numbers), numbers[0], workers, by)
    except KeyboardInterrupt:
        stopped = True
    rows = summary(results, by) + rows
    if json:
        typer.echo(jsonlib.dumps(rows, indent=2))
    elif rows:
        _show(rows, results, by, seeds)
    if stopped:
        of = "the figures are of these" if rows else "nothing is kept"
        fail(f"stopped after {len(results)} of {len(jobs)} runs; {of}", 130)


def _show(
    rows: list[dict[str, Any]], results: list[dict[str, Any]], by: tuple[str, ...], seeds: str
) -> None:
    """Print the table of goals, and every run that went wrong."""
    table = Table("", *by, "goal", title=f"base, seeds {seeds}")
    for row in rows:
        cells = [_cell(row[rule], row["met"][rule]) for rule in by]
        goal = "" if row["goal"] is None else ("≥ " if row["least"] else "≤ ") + f"{row['goal']:g}"
        table.add_row(escape(row["figure"]), *cells, goal)
    console.print(table)
    for r in results:
        if r["collided"] or not r["arrived"]:
            console.print(escape(f"{r['case']}, {r['rule']}, seed {r['seed']}: {r['outcome']}"))


def summary(results: list[dict[str, Any]], rules: tuple[str, ...]) -> list[dict[str, Any]]:
    """One row a goal of a case that was run: its value by rule, and whether that meets it."""
    runs = Counter(r["case"] for r in results)
    rows = []
    for goal in GOALS:
        if not runs[goal.case]:
            continue
        values = {rule: goal.value([r for r in results if r["rule"] == rule]) for rule in rules}
        rows.append(
            {
                "figure": goal.label,
                "case": goal.case,
                "runs": runs[goal.case] // len(rules),
                **values,
                "goal": goal.bound,
                "least": goal.least,
                "met": {rule: goal.met(value) for rule, value in values.items()},
            }
        )
    return rows


def _names(text: str, option: str, known: tuple[str, ...]) -> tuple[str, ...]:
    names = tuple(filter(None, text.split(","))) or known
    for name in names:
        if name not in known:
            fail(f"{option}: there is no {name!r}. Known: {', '.join(known)}", 2)
    return names


def _cell(value: float | None, met: bool | None) -> str:
    if value is None:
        return "-"
    if met is None:
        return f"{value:.3g}"
    return f"[green]{value:.3g} met[/]" if met else f"[red]{value:.3g} missed[/]"
