"""``steadyhand run``: a scenario in lockstep, judged, with pictures and a log."""

from __future__ import annotations

import json as jsonlib
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from services.cli.common import OBSERVERS, Json, console, fail
from services.cli.progress import busy, progress
from services.reports.labels import (
    BOTTLE_LABELS,
    GRASP_LABELS,
    LABELS,
    PEN_LABELS,
    PLATFORM_LABELS,
)


def run(
    scenario: Annotated[str, typer.Argument(help="Name or file of a scenario.")],
    seed: Annotated[int, typer.Option(min=0, help="Of everything random.")] = 0,
    observer: Annotated[str, typer.Option(help=OBSERVERS)] = "ekf",
    duration: Annotated[
        float | None, typer.Option("--for", help="Instead of the scenario's limit [s].")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for log and pictures.")] = None,
    pictures: Annotated[bool, typer.Option(help="Draw the pictures.")] = True,
    json: Json = False,
) -> None:
    """Run a scenario in lockstep; print figures, write log and pictures under runs/."""
    from arm.hds import ProgramError
    from deploy.tomlfile import BadFile
    from observer.observer import KINDS
    from services.run import run_lockstep, write, write_report
    from sim.scenario import load_scenario

    if duration is not None and duration <= 0:
        fail(f"--for needs a positive number of seconds, not {duration:g}", 2)
    if observer not in KINDS:
        fail(f"no observer {observer!r}. Known: {', '.join(KINDS)}", 2)
    try:
        loaded = load_scenario(scenario)
        folder = out or Path("runs") / f"{loaded.name}-{observer}-{seed}"
        fresh_folder(folder)
        most = loaded.duration if duration is None else duration
        with progress(loaded.name, most, "s at most", quiet=json) as tell:
            done = run_lockstep(loaded, seed, observer, duration, progress=tell)
        with busy("writing the log", quiet=json):
            write(done, folder)
    except (BadFile, ProgramError, ValueError) as error:
        fail(str(error), 2)
    except OSError as error:
        fail(f"cannot write to {error.filename}: {error.strerror}", 2)
    except KeyboardInterrupt:
        with suppress(OSError):
            folder.rmdir()  # unless there was something in it before
        fail("stopped before the end; nothing is written", 130)
    title = f"{loaded.name}, observer {observer}, seed {seed}"
    with busy("drawing the pictures", quiet=json or not pictures):
        write_report(done.log, done.result, folder, title, pictures, loaded)
    if json:
        typer.echo(jsonlib.dumps(done.result))
    else:
        show(done.result)
        what = "log and pictures" if pictures else "log"
        console.print(f"{what} in {folder}", highlight=False, soft_wrap=True)
    if not done.result["outcome"].startswith("finished") or not done_well(done.result):
        raise typer.Exit(1)


def done_well(result: dict[str, Any]) -> bool:
    """Whether what was to be lifted or placed is."""
    return result.get("lifted") is not False and result.get("placed") is not False


def fresh_folder(folder: Path) -> None:
    """Make a folder for a run, and take an earlier run's pictures and result out of it."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in (*folder.glob("*.png"), folder / "result.json"):
        old.unlink(missing_ok=True)


def show(result: dict[str, Any]) -> None:
    """Print a result as a table; rows of the pen and of the platform where they mean something."""
    title = f"{result['scenario']}, observer {result['observer']}, seed {result['seed']}"
    table = Table(title=title, show_header=False)
    table.add_row("outcome", str(result["outcome"]))
    grasps = "lifted" in result
    pen = PEN_LABELS if result.get("arm_worked", True) and not grasps else {}
    if "placed" in result:
        table.add_row("bottle placed", "yes" if result["placed"] else "no")
        pen = BOTTLE_LABELS
    if grasps:
        table.add_row("box lifted", "yes" if result["lifted"] else "no")
        pen = GRASP_LABELS
    platform = {k: v for k, v in PLATFORM_LABELS.items() if result.get(k) is not None}
    for key, label in (pen | platform | LABELS).items():
        value = result.get(key)
        table.add_row(escape(label), "-" if value is None else f"{value:.4g}")
    console.print(table)
    if result.get("loops"):
        _show_loops(result["loops"])


def _show_loops(loops: dict[str, dict[str, float]]) -> None:
    heads = ("service", "period", "late 50 %", "late 99 %", "late max", "missed", "ticks")
    table = Table(*heads, title="loops [ms]".replace("[", "\\["))
    for name, f in loops.items():
        late = [f"{f[key]:.2f}" for key in ("late_p50_ms", "late_p99_ms", "late_max_ms")]
        table.add_row(
            name, f"{f['period_mean_ms']:.2f}", *late, f"{f['missed']:.0f}", f"{f['ticks']:.0f}"
        )
    console.print(table)
