"""``steadyhand bench``: the figures this project stands by, beside their baselines in one run."""

from __future__ import annotations

import json as jsonlib
import re
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from statistics import median
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.progress import track
from rich.table import Table

from services.cli import bench_approach as cli_bench_approach
from services.cli import bench_arm as cli_bench_arm
from services.cli import bench_base as cli_bench_base
from services.cli import bench_console as cli_bench_console
from services.cli import bench_faults as cli_bench_faults
from services.cli import bench_hostile as cli_bench_hostile
from services.cli import bench_loop as cli_bench_loop
from services.cli import bench_observer as cli_bench_observer
from services.cli import bench_page as cli_bench_page
from services.cli import bench_soak as cli_bench_soak
from services.cli.common import Json, console, fail
from services.reports.evaluation import DRAWING_FIGURES, ESTIMATE_FIGURES, PEN_FIGURES

bench = typer.Typer(
    help="Benchmarks; --json for scripts.", no_args_is_help=True, rich_markup_mode=None
)

CASES = (
    ("whiteboard", "truth"),
    ("whiteboard", "ekf"),
    ("whiteboard_moving", "truth"),
    ("whiteboard_moving", "ekf"),
    ("whiteboard_moving", "taylor"),
    ("whiteboard_moving", "hold"),
)
FIGURES = (*DRAWING_FIGURES, *ESTIMATE_FIGURES, *PEN_FIGURES, "realtime_factor")
bench.command(name="observer")(cli_bench_observer.observer)
bench.command(name="arm")(cli_bench_arm.arm)
bench.command(name="base")(cli_bench_base.base)
bench.command(name="hostile")(cli_bench_hostile.hostile)
bench.command(name="approach")(cli_bench_approach.approach)
bench.command(name="faults")(cli_bench_faults.faults)
bench.command(name="loop")(cli_bench_loop.loop)
bench.command(name="page")(cli_bench_page.page)
bench.command(name="soak")(cli_bench_soak.soak)
bench.command(name="console")(cli_bench_console.console_)


@bench.command()
def whiteboard(
    seeds: Annotated[str, typer.Option(help="First and last seed.")] = "100-109",
    workers: Annotated[int, typer.Option(min=1, help="Runs side by side; 1 to measure speed.")] = 1,
    json: Json = False,
) -> None:
    """Draw standing and moving with every observer; the median over seeds of every figure."""
    rows = measure(parse_seeds(seeds), workers, quiet=json)
    if json:
        typer.echo(jsonlib.dumps(rows, indent=2))
        return
    heads = [f"{row['scenario'].replace('whiteboard_', '')}\n{row['observer']}" for row in rows]
    table = Table("", *heads, title=f"medians over seeds {seeds}")
    for figure in ("finished", *FIGURES):
        cells = ["-" if row[figure] is None else f"{row[figure]:.3g}" for row in rows]
        table.add_row(escape(figure), *cells)
    console.print(table)


def parse_seeds(text: str) -> range:
    """A range of seeds from ``7`` or ``100-109``; leaves with an error if it is neither."""
    match = re.fullmatch(r"(\d+)(?:-(\d+))?", text)
    if match is None or int(match[2] or match[1]) < int(match[1]):
        fail(f"--seeds takes a number or first-last, like 100-109, not {text!r}", 2)
    return range(int(match[1]), int(match[2] or match[1]) + 1)


def measure(seeds: Iterable[int], workers: int, quiet: bool) -> list[dict[str, Any]]:
    """One row a case: the median over seeds of every figure, and how often it finished."""
    jobs = [(scenario, observer, seed) for scenario, observer in CASES for seed in seeds]
    results: list[dict[str, Any]] = []
    with ProcessPoolExecutor(max_workers=workers) as pool:
        done = pool.map(_one, jobs)
        results.extend(track(done, total=len(jobs), disable=quiet, console=console))
    rows = []
    for scenario, observer in CASES:
        mine = [r for r in results if (r["scenario"], r["observer"]) == (scenario, observer)]
        row: dict[str, Any] = {
            "scenario": scenario,
            "observer": observer,
            "runs": len(mine),
            "finished": sum(r["outcome"].startswith("finished") for r in mine),
        }
        for figure in FIGURES:
            values = [r[figure] for r in mine if r[figure] is not None]
            row[figure] = median(values) if values else None
        rows.append(row)
    return rows


def _one(job: tuple[str, str, int]) -> dict[str, Any]:
    from services.run import run_lockstep
    from sim.scenario import load_scenario

    scenario, observer, seed = job
    return run_lockstep(load_scenario(scenario), seed, observer).result
