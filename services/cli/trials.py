"""``steadyhand trials``: many trials of an experiment, in parallel, judged with intervals."""

from __future__ import annotations

import json as jsonlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from services.cli.common import Json, console, errors, fail, show_json

if TYPE_CHECKING:
    from services.trials.campaign import Outcome
    from services.trials.experiment import Experiment
    from services.trials.lines import Line
    from services.trials.work import Record

SHOWN_FAILURES = 10


def trials(
    experiment: Annotated[
        str, typer.Argument(help="Name or Python file of an experiment; without: lists them.")
    ] = "",
    options: Annotated[
        list[str] | None, typer.Argument(help="Its options as key=value.", metavar="[KEY=VALUE]...")
    ] = None,
    count: Annotated[int, typer.Option("--trials", min=1, help="How many.")] = 10,
    seed: Annotated[
        int, typer.Option(min=0, help="Of the first trial; the next has the next.")
    ] = 0,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Trials at once: 1 by default; of a cluster, all it can."),
    ] = None,
    cluster: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, like tcp://10.0.0.1:8786.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for rows, table and pictures.")] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with what the folder holds.")
    ] = False,
    replay: Annotated[
        int | None, typer.Option(min=0, help="Run the trial of this seed again, here, and show it.")
    ] = None,
    json: Json = False,
) -> None:
    """Try an experiment many times, on cores of this machine or on a Dask cluster, and judge it.

    The rows depend on experiment, seeds and options only. Exit code 1 if a trial could not be run.
    """
    from services.trials.work import ONE_THREAD

    os.environ.update(ONE_THREAD)  # before numpy is here: a replay runs in this process
    from services.trials.experiment import BadExperiment, known, load
    from services.trials.journal import BadFolder
    from services.trials.options import checked, parse

    if not experiment:
        _list(known(), json)
        return
    try:
        loaded = load(experiment)
        given = parse(loaded, options or [])
        folder = out or Path("runs") / f"trials-{loaded.name}-seed{seed}"
        if replay is not None:
            _replay(loaded, given, replay, folder, json)
            return
        complete = checked(loaded, given).model_dump(mode="json")
        _campaign(loaded, complete, count, seed, workers, cluster, folder, resume, json)
    except (BadExperiment, BadFolder) as error:
        fail(str(error), 2)
    except OSError as error:
        if error.filename is None:
            raise
        fail(f"cannot write to {error.filename}: {error.strerror}", 2)


def _list(names: dict[str, str], json: bool) -> None:
    if json:
        show_json(names)
        return
    table = Table(show_header=False, box=None)
    for name, description in names.items():
        table.add_row(name, escape(description))
    console.print(table)


def _campaign(
    experiment: Experiment,
    options: dict[str, Any],
    count: int,
    seed: int,
    workers: int | None,
    cluster: str | None,
    folder: Path,
    resume: bool,
    json: bool,
) -> None:
    from services.trials.campaign import conduct
    from services.trials.code import code_of
    from services.trials.journal import About

    about = About(experiment.source, seed, options, code_of(experiment))
    ended = 0
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]}"),
        TimeRemainingColumn(),
        console=console,
        disable=json,
    ) as progress:
        bar = progress.add_task(experiment.name, total=count, failed="")
        failed = 0

        def watch(record: Record | None, done: int, total: int) -> None:
            nonlocal failed, ended
            ended = done
            failed += record is not None and record["status"] != "done"
            told = f"{failed} failed" if failed else ""
            progress.update(bar, completed=done, total=total, failed=told)

        try:
            outcome = conduct(
                experiment, about, count, folder, workers, cluster, resume, watch=watch
            )
        except KeyboardInterrupt:
            progress.stop()
            fail(f"stopped after {ended} of {count} trials. The same with --resume goes on")
        except RuntimeError as error:
            progress.stop()
            _cluster_failed(error)
    if json:
        show_json(outcome.data())
    else:
        show(experiment, outcome)
    raise typer.Exit(1 if outcome.unfinished else 0)


def _cluster_failed(error: RuntimeError) -> NoReturn:
    from services.trials.cluster import BadCluster

    if not isinstance(error, BadCluster):
        raise error
    fail(str(error))


def show(experiment: Experiment, outcome: Outcome) -> None:
    """Print a campaign: its table, what failed, what it cost."""
    about = outcome.about
    last = about.seed + len(outcome.records) - 1
    title = f"{experiment.name}, seeds {about.seed}-{last}"
    table = Table("", box=SIMPLE_HEAD, pad_edge=False, title=title)  # only labels may wrap
    for head in ("", "95 % interval", "n", "goal", ""):
        table.add_column(head, no_wrap=True, justify="right" if head == "n" else "left")
    for line in outcome.lines:
        table.add_row(*_cells(line))
    console.print(table)
    unfinished = outcome.unfinished
    for record in unfinished[:SHOWN_FAILURES]:
        told = f"[red]{record['status']}[/] seed {record['seed']}: {escape(record['error'])}"
        console.print(told, highlight=False, soft_wrap=True)
    if unfinished:
        console.print(
            f"{len(unfinished)} of {len(outcome.records)} trials are not in the table; again: "
            f"steadyhand trials {escape(about.experiment)} --replay {unfinished[0]['seed']} "
            f"--out {escape(str(outcome.folder))}",
            highlight=False,
            soft_wrap=True,
        )
    effort = outcome.effort
    if effort.efficiency is not None:
        console.print(
            f"{effort.trials} trials in {effort.wall:.1f} s on {effort.workers} workers, "
            f"{effort.busy / effort.trials:.2f} s each; workers busy "
            f"{100 * effort.efficiency:.0f} % of the time",
            highlight=False,
        )
    console.print(f"rows, table and pictures in {escape(str(outcome.folder))}", highlight=False)


def _cells(line: Line) -> list[str]:
    def number(x: float | None) -> str:
        return "-" if x is None else f"{100 * x:.3g} %" if line.share else f"{x:.4g}"

    interval = "" if line.low is None else f"{number(line.low)} to {number(line.high)}"
    goal = "" if line.goal is None else ("≥ " if line.least else "≤ ") + number(line.goal)
    verdict = {True: "[green]met[/]", False: "[red]missed[/]", None: ""}[line.met]
    return [escape(line.label), number(line.value), interval, str(line.n), goal, verdict]


def _replay(
    experiment: Experiment, given: dict[str, Any], seed: int, folder: Path, json: bool
) -> None:
    from services.trials.replay import replay

    done = replay(experiment, given, seed, folder)
    record = done.record
    if json:
        show_json({**record, "options": done.options, "same": done.same, "files": done.files})
    else:
        console.print(f"[bold]{experiment.name}[/], seed {seed}, {escape(str(done.options))}")
        if record["row"] is not None:
            table = Table(show_header=False)
            for key, value in record["row"].items():
                table.add_row(escape(key), escape(jsonlib.dumps(value)[:200]))
            console.print(table)
        else:
            errors.print(escape(record["traceback"]), highlight=False)
        if done.same is not None:
            said = "[green]the same[/] as" if done.same else "[red]not the same[/] as"
            console.print(f"{said} in the campaign in {escape(str(folder))}", highlight=False)
            for difference in done.changed:
                console.print(f"since then changed: {escape(difference)}", highlight=False)
        if done.files:
            console.print(f"all of it in {escape(str(done.files))}", highlight=False)
    raise typer.Exit(0 if record["status"] == "done" and done.same is not False else 1)
