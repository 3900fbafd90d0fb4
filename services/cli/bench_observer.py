"""``steadyhand bench observer``: how good the observer is, beside what it is compared with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import track
from rich.table import Table

from services.cli.common import Json, console, errors, fail, show_json, writing

if TYPE_CHECKING:
    from observer.bench.goals import Verdict

COLUMNS = {
    "rms_mm": "rms\nmm",
    "rms_deg": "rms\ndeg",
    "max_mm": "max\nmm",
    "ratio_to_exact": "over\nexact",
    "yaw_ratio_to_exact": "same,\nyaw",
    "relative_100ms_mm": "in 0.1 s\nmm",
    "relative_1s_mm": "in 1 s\nmm",
    "max_step_mm_per_ms": "step\nmm/ms",
    "max_step_deg_per_ms": "step\ndeg/ms",
    "latency_ms": "late\nms",
    "nees": "NEES\n",
    "step_us_median": "cost\nus",
    "step_us_p99": "99 %\nus",
}
WIDTH = 126
"""Of the widest table."""
SPECIAL = {
    "push": {"in_push_rms_mm": "in push\nmm"},
    "slip": {
        "flagged_within_200ms": "seen in\n0.2 s",
        "detection_ms_median": "seen\nms",
        "false_alarms_per_10min": "alarms\n/10 min",
    },
    "dropout": {
        "gap_inside_3_sigma": "in 3\nsigma",
        "gap_end_mm": "at end\nmm",
        "gap_step_mm_per_ms": "return\nmm/ms",
    },
}
"""Columns beside those, by motion."""


def observer(
    seed: Annotated[
        int, typer.Option(min=0, help="First seed; constants were chosen below 200.")
    ] = 1000,
    runs: Annotated[int, typer.Option(min=1, help="Worlds per motion and rate.")] = 10,
    odometry_hz: Annotated[
        list[float] | None, typer.Option(help="Rate of odometry; repeatable. Default 20, 10, 5.")
    ] = None,
    motion: Annotated[
        list[str] | None, typer.Option(help="Class of motion; repeatable. Default: all.")
    ] = None,
    estimator: Annotated[
        list[str] | None, typer.Option(help="Who is compared; repeatable. Default: all.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes; 1 to measure cost.")] = 1,
    plots: Annotated[Path | None, typer.Option(help="Folder for pictures.")] = None,
    json: Json = False,
) -> None:
    """Follow seeded planar worlds with the observer, baselines and references."""
    from observer.bench.estimators import ESTIMATORS
    from observer.bench.goals import check
    from observer.bench.motions import MOTIONS
    from observer.bench.rows import rows
    from services.bench.observer import TUNING, Plan, jobs, measure

    chosen = Plan()
    plan = Plan(
        motions=_known("motion", motion, MOTIONS),
        rates=tuple(_rate(hz) for hz in odometry_hz) if odometry_hz else chosen.rates,
        estimators=_known("estimator", estimator, ESTIMATORS),
        seed=seed,
        runs=runs,
    )
    if plots is not None:
        with writing():  # before the long work
            plots.mkdir(parents=True, exist_ok=True)
    total = len(jobs(plan))
    scores = measure(
        plan,
        workers,
        lambda done: track(done, "worlds", total=total, disable=json, console=errors),
    )
    table = rows(scores, runs)
    if json:
        show_json(table)
    else:
        for rate in plan.rates:
            for name in plan.motions:
                _show(_table(name, rate, MOTIONS[name].about, table))
        _show(_goals(check(table)))
        console.print(_remarks(seed, runs, workers, TUNING), highlight=False)
    if plots is not None:
        from services.bench.observer_plots import write_plots

        with writing():
            files = write_plots(plots, scores, table, plan)
        if not json:
            console.print(f"{len(files)} pictures in {plots}", highlight=False)


def _show(table: Table) -> None:
    """Print a table no narrower than its figures need; a narrow terminal wraps its lines."""
    wide = Console(width=max(console.width, WIDTH))
    wide.print(table)
    wide.print()


def _known(what: str, asked: list[str] | None, table: dict[str, Any]) -> tuple[str, ...]:
    """The names asked for, all if none; leaves with an error at an unknown one."""
    for name in asked or ():
        if name not in table:
            fail(f"no {what} {name!r}. Known: {', '.join(table)}", 2)
    return tuple(dict.fromkeys(asked)) if asked else tuple(table)


def _rate(hz: float) -> float:
    """A rate whose period is whole milliseconds; leaves with an error at another one."""
    if not 0.5 <= hz <= 200.0 or abs(1000.0 / hz - round(1000.0 / hz)) > 1e-9:
        fail(f"--odometry-hz needs a period of whole milliseconds, 0.5 to 200 Hz, not {hz:g}", 2)
    return hz


def _table(motion: str, rate: float, about: str, rows: Sequence[dict[str, Any]]) -> Table:
    columns = {**COLUMNS, **SPECIAL.get(motion, {})}
    title = f"[bold]{motion}[/], odometry {rate:g} Hz: {escape(about)}"
    table = Table(title=title, title_justify="left", padding=(0, 1, 0, 0), box=None)
    table.add_column("\n", no_wrap=True)
    for head in columns.values():
        table.add_column(head, justify="right")
    for row in rows:
        if (row["motion"], row["odometry_hz"]) == (motion, rate):
            table.add_row(row["estimator"], *(_number(row[name]) for name in columns))
    return table


def _number(value: float | None) -> str:
    """Three digits, without an exponent for what may occur here."""
    if value is None:
        return "-"
    if abs(value) >= 100.0:
        return f"{value:.0f}"
    return "0" if abs(value) < 5e-7 else f"{value:.3g}"


def _goals(verdicts: Sequence[Verdict]) -> Table:
    table = Table(title="Goals of ekf", title_justify="left", box=None, padding=(0, 2, 0, 0))
    table.add_column("figure", no_wrap=True)
    table.add_column("goal", justify="right", no_wrap=True)
    table.add_column("worst", justify="right")
    table.add_column("", no_wrap=True)
    table.add_column("where")
    for v in verdicts:
        low, high = v.bounds if v.met is not None else (v.goal.low, v.goal.high)
        if v.goal.band and v.met is None:
            bound = "in band"
        elif low == float("-inf"):
            bound = f"<= {_number(high)}"
        elif high == float("inf"):
            bound = f">= {_number(low)}"
        else:
            bound = f"{_number(low)}..{_number(high)}"
        if v.met is None:
            table.add_row(escape(v.goal.text), bound, "-", "not measured", "")
        elif v.met:
            table.add_row(escape(v.goal.text), bound, _number(v.value), "[green]met[/]", v.where)
        else:
            where = f"{v.where}; in {len(v.missed)} of {v.rows}"
            table.add_row(escape(v.goal.text), bound, _number(v.value), "[red]missed[/]", where)
    return table


def _remarks(seed: int, runs: int, workers: int, tuning: int) -> str:
    text = [f"Runs of each: {runs}, from seed {seed}; their first 5 s do not count."]
    if seed < tuning:
        text.append(f"Constants were chosen on seeds below {tuning}: this is no fair test.")
    if runs < 100:
        text.append("The band of the NEES is that for these runs; 100 make it 2.54..3.50.")
    if workers > 1:
        text.append("Costs were measured with other work running; use --workers 1.")
    return "\n".join(text)
