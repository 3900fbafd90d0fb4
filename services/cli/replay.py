"""``steadyhand replay`` and ``tune``: the observer over a recorded log, and the noise in it."""

from __future__ import annotations

import json as jsonlib
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from services.cli.common import Json, console, fail, writing
from services.cli.progress import busy
from services.cli.replay_again import again, show_again, show_lines
from services.cli.replay_again import data_of as again_data

if TYPE_CHECKING:
    from observer.recordings.facts import Diagnosis
    from observer.recordings.log import Verdict
    from observer.recordings.recording import Recording
    from services.replays.run import Replayed
    from services.replays.tune import Report

Log = Annotated[Path, typer.Argument(help="A log (.mcap), a run's folder, or a recording's TOML.")]
COLOURS = {"warning": "yellow", "note": "dim"}


def replay(
    log: Log,
    out: Annotated[Path | None, typer.Option(help="Folder for report and pictures.")] = None,
    observer: Annotated[str, typer.Option(help="ekf, imm, undelayed, taylor or hold.")] = "ekf",
    seconds: Annotated[
        float | None, typer.Option(help="Only the first so many seconds of the log.")
    ] = None,
    as_is: Annotated[
        bool, typer.Option("--as-is", help="Correct nothing, whatever the diagnosis.")
    ] = False,
    pictures: Annotated[bool, typer.Option(help="Draw the pictures.")] = True,
    arm: Annotated[
        bool, typer.Option("--arm", help="The arm instead: does it decide as it did in the run?")
    ] = False,
    base: Annotated[
        bool, typer.Option("--base", help="The platform's behaviours instead.")
    ] = False,
    json: Json = False,
) -> None:
    """Run the observer over a recorded log: what is wrong with it, and how good the estimate is.

    Of a run of ours it also says whether the observer says to the last bit what it said then;
    with --arm or --base the same of those, over what they heard.
    """
    if arm or base:
        with busy("running it again", quiet=json):
            done_again = again(log, "arm" if arm else "base")
        show_again(done_again, json)
    from observer.recordings.part import cut
    from observer.recordings.run import span
    from services.replays.run import KINDS, PICTURES, data_of, replay_recording

    if observer not in KINDS:
        fail(f"no observer {observer!r} for a log. Known: {', '.join(KINDS)}", 2)
    if seconds is not None and not seconds >= 1.0:
        fail(f"--seconds needs 1 or more, not {seconds:g}", 2)
    recording = _opened(log)
    if seconds is not None:
        try:
            start = span(recording)[0]
        except ValueError as error:
            fail(str(error))
        recording = cut(recording, start, start + seconds)
    folder = out or Path("runs") / f"replay-{file_name(recording.name)}"
    with writing():
        folder.mkdir(parents=True, exist_ok=True)
        for name in PICTURES:  # of an earlier replay; the folder may hold more than ours
            (folder / f"{name}.png").unlink(missing_ok=True)
    try:
        with busy(f"replaying {log.name}", quiet=json):
            done = replay_recording(recording, observer, as_is)
    except ValueError as error:
        fail(str(error))
    data = data_of(done)
    with busy("replaying it as it was", quiet=json):
        same = again(log, "observer") if log.suffix != ".toml" and seconds is None else None
    if same is not None:
        data["again"] = again_data(same)
    with writing():
        (folder / "report.json").write_text(jsonlib.dumps(data, indent=2) + "\n")
        if pictures:
            from services.replays.pictures import write_pictures

            with busy("drawing the pictures", quiet=json):
                write_pictures(done, folder)
    if json:
        typer.echo(jsonlib.dumps(data))
    else:
        _show(done, data)
        if same is not None:
            show_lines(same)
        what = "report.json and pictures" if pictures else "report.json"
        console.print(f"{what} in {folder}", highlight=False)


def tune(
    log: Log,
    seconds: Annotated[float, typer.Option(help="How much of the log is used [s].")] = 30.0,
    out: Annotated[Path | None, typer.Option(help="File for the TOML; printed anyway.")] = None,
    json: Json = False,
) -> None:
    """Find the likeliest noise, disturbance and lag of a recorded log, to paste in robot.toml."""
    from services.replays.tune import data_of, fragment, tune_recording

    if not seconds >= 5.0:
        fail(f"--seconds needs 5 or more, not {seconds:g}", 2)
    if out is not None and not out.parent.is_dir():
        fail(f"cannot write to {out}: there is no folder {out.parent}", 2)
    recording = _opened(log)
    try:
        with busy(f"tuning on {log.name}", quiet=json):
            report = tune_recording(recording, seconds)
    except ValueError as error:
        fail(str(error))
    text = fragment(report)
    if out is not None:
        with writing():
            out.write_text(text)
    if json:
        typer.echo(jsonlib.dumps(data_of(report)))
        return
    _show_tuning(report)
    console.print(escape(text), highlight=False, soft_wrap=True)
    if out is not None:
        console.print(f"the same in {out}", highlight=False)


def file_name(name: str) -> str:
    """A recording's name as that of one file: no folders, nothing a shell would mind."""
    return re.sub(r"[^\w.-]+", "_", name)


def _opened(log: Path) -> Recording:
    from deploy.tomlfile import BadFile
    from services.logs.recordings import open_recording
    from services.logs.runlog import BadLog

    try:
        return open_recording(log)
    except (BadFile, BadLog, OSError) as error:
        fail(str(error), 2)


# -- what people see ---------------------------------------------------------------------------


def _show(done: Replayed, data: dict[str, Any]) -> None:
    as_is = ", nothing corrected" if data["as_is"] else ""
    console.print(
        f"[bold]{escape(done.recording.name)}[/]: {data['seconds']:.1f} s, "
        f"observer {done.kind}{as_is}",
        highlight=False,
    )
    console.print(_sensors(done.diagnosis))
    _show_verdicts(done.verdicts)
    if done.scores:
        for table in _scores(done):
            console.print(table)
        sigma = done.recording.reference_sigma
        if sigma:
            console.print(
                f"the reference itself scatters by {sigma:g} m in x and in y, "
                f"which alone makes {math.sqrt(2.0) * sigma:.2f} m",
                highlight=False,
                soft_wrap=True,
            )
    else:
        console.print("no reference: the way is compared with nothing, only the filter with itself")
    for name, c in data["consistency"].items():
        low, high = c["nis_band"]
        console.print(
            f"NIS of {name}: {c['nis_mean']:.2f} over {c['innovations']} "
            f"(3 is right, chance alone {low:.2f} to {high:.2f}); {c['refused']} refused",
            highlight=False,
            soft_wrap=True,
        )
    said = ", ".join(
        f"{text} {100 * share:.3g} %"
        for text, share in data["said"].items()
        if share > 1e-3 and not (data["dead_reckoned"] and text.endswith("uncertain"))
    )
    valid = f"valid {100 * data['valid_share']:.3g} % of the time"
    if data["dead_reckoned"]:
        valid = "run on wheel speeds: position is dead-reckoned, so `valid` (20 mm) does not apply"
    console.print(
        f"{valid}{'; said: ' + said if said else ''}",
        highlight=False,
        soft_wrap=True,
    )


def _sensors(diagnosis: Diagnosis) -> Table:
    table = _table("", "samples", "a second", "arrives after", "longest pause")
    for name, t in diagnosis.timing.items():
        pause = max((b - a for a, b in t.gaps), default=1.0 / t.rate)
        table.add_row(
            name, str(t.samples), f"{t.rate:.3g}", f"{1e3 * t.latency:.3g} ms", f"{pause:.3g} s"
        )
    return table


def _show_verdicts(verdicts: list[Verdict]) -> None:
    for v in verdicts:
        colour = COLOURS.get(v.severity, "default")
        advice = f" [cyan]-> {escape(v.advice)}[/]" if v.advice else ""
        console.print(
            f"[{colour}]{v.severity:8}[/]{escape(v.text)}{advice}", highlight=False, soft_wrap=True
        )


def _scores(done: Replayed) -> list[Table]:
    """One table of the way and, if the reference has a heading, one of that."""
    from services.replays.run import in_unit

    factor, unit = in_unit([s.position_rms for s in done.scores.values()])
    within = [f"{r.span:g} s" for r in next(iter(done.scores.values())).relative]
    tables = [_table(f"error of the way [{unit}]", "rms", "largest", *(f"in {w}" for w in within))]
    headed = any(math.isfinite(s.heading_rms) for s in done.scores.values())
    if headed:
        tables.append(_table("error of the heading [deg]", "rms", *(f"in {w}" for w in within)))
    for name, s in done.scores.items():
        style = "bold" if name == done.kind else ""
        lengths = (s.position_rms, s.position_max, *(r.position for r in s.relative))
        tables[0].add_row(name, *(_cell(factor * x) for x in lengths), style=style)
        if headed:
            angles = (s.heading_rms, *(r.heading for r in s.relative))
            tables[1].add_row(name, *(_cell(math.degrees(x)) for x in angles), style=style)
    return tables


def _table(first: str, *heads: str) -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column(escape(first), no_wrap=True)
    for head in heads:
        table.add_column(head, justify="right", no_wrap=True)
    return table


def _cell(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "-"


def _show_tuning(report: Report) -> None:
    t = report.tuning
    start, end = t.span
    console.print(
        f"[bold]{escape(report.recording.name)}[/]: the liveliest part, {start:.1f} to {end:.1f} s,"
        f" {t.innovations} innovations",
        highlight=False,
    )
    _show_verdicts([v for v in report.verdicts if v.severity != "note"])
    table = _table("", "", "described", "likeliest", "+-", "")
    for x in t.tuned:
        factor = x.after / x.before if x.before else math.inf
        table.add_row(
            x.parameter.name,
            x.parameter.unit,
            f"{x.before:.4g}",
            f"{x.after:.4g}" if x.told else "not told",
            f"{100 * x.deviation:.0f} %" if x.told else "",
            f"x {factor:.2f}" if x.told else "",
        )
    console.print(table)
    before, after = t.log_likelihood
    console.print(f"log-likelihood {before:.0f} -> {after:.0f}", highlight=False)
    for name, (old, new) in t.nis.items():
        console.print(f"NIS of {name} {old:.2f} -> {new:.2f} (3 is right)", highlight=False)
    if report.scores is not None:
        from services.replays.run import in_unit

        old, new = report.scores
        factor, unit = in_unit([old, new])
        worse = " [yellow]worse: do not use it[/]" if new > 1.05 * old else ""
        console.print(
            f"error against the reference, whole log: {factor * old:.3g} -> {factor * new:.3g} "
            f"{unit} rms{worse}",
            highlight=False,
        )
