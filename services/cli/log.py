"""``steadyhand log info, recover, export, plot``: look into a log, mend it, take it elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from services.cli.common import Json, console, fail, show_json, writing
from services.cli.progress import busy

if TYPE_CHECKING:
    from services.logs.info import LogInfo

log = typer.Typer(
    help="Logs of runs: what is in them, mend, export, plot.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
File = Annotated[Path, typer.Argument(help="A log (.mcap), or the folder of a run.")]
LONG = 60
"""Metadata longer than this are files; their size is shown, not they themselves."""


@contextmanager
def _good_log() -> Iterator[None]:
    """Leave with an error and exit code 2 if something inside is no log."""
    from services.logs.file import BadLog

    try:
        with writing(), busy("working through the log"):
            yield
    except BadLog as error:
        fail(str(error), 2)


def _file(path: Path) -> Path:
    """The one log that is meant; leaves with an error if a folder has several."""
    from services.logs.file import BadLog
    from services.logs.runlog import parts_of

    if not path.is_dir():
        return path
    with _good_log():
        parts = parts_of(path)
        if len(parts) > 1:
            names = ", ".join(p.name for p in parts)
            raise BadLog(f"{path}: its recorder was restarted; name one of its logs: {names}")
    return parts[0]


@log.command()
def info(file: File, json: Json = False) -> None:
    """Show where a log comes from, what is in it, what was lost, and whether it is whole."""
    from services.logs.info import info_of

    with _good_log():
        found = info_of(_file(file))
    if json:
        show_json(
            {
                "file": str(found.path),
                "bytes": found.size,
                "whole": found.whole,
                "start_s": found.start,
                "end_s": found.end,
                "about": found.about,
                "recorder": found.ended,
                "recovered": found.recovered,
                "topics": {
                    t.name: {"messages": t.messages, "rate_hz": t.rate, "json_bytes": t.bytes}
                    for t in found.topics
                },
            }
        )
    else:
        _show(found)
    raise typer.Exit(0 if found.whole else 1)


def _show(found: LogInfo) -> None:
    seconds = found.end - found.start
    minute = found.size / seconds * 60e-6 if seconds > 0 else 0.0
    console.print(
        f"[bold]{escape(str(found.path))}[/]: {found.start:.3f} to {found.end:.3f} s,"
        f" {found.size / 1e6:.1f} MB, {minute:.1f} MB a minute",
        highlight=False,
        soft_wrap=True,
    )
    for key, text in found.about.items():
        words = text if len(text) <= LONG and "\n" not in text else f"({len(text)} characters)"
        console.print(f"  {escape(key):18} {escape(words)}", highlight=False, soft_wrap=True)
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("topic", no_wrap=True)
    for head in ("messages", "a second", "JSON MB"):
        table.add_column(head, justify="right")
    for t in found.topics:
        table.add_row(t.name, str(t.messages), f"{t.rate:.4g}", f"{t.bytes / 1e6:.2f}")
    console.print(table)
    if found.recovered:
        source, until = found.recovered.get("from", "?"), found.recovered.get("until", "?")
        console.print(f"recovered from {escape(source)}, which is whole until {until}")
    if found.ended:
        lost = {k[5:]: n for k, n in found.ended.items() if k.startswith("lost ")}
        which = f" ({', '.join(f'{n} of {k}' for k, n in lost.items())})" if lost else ""
        heard, missed, refused = (found.ended.get(k, "?") for k in ("heard", "lost", "refused"))
        console.print(
            f"the recorder heard {heard} messages, lost {missed}{which}, refused {refused}",
            highlight=False,
            soft_wrap=True,
        )
    if not found.whole:
        console.print(f"[yellow]not whole:[/] {escape(found.why)}", highlight=False, soft_wrap=True)


@log.command()
def recover(
    file: Annotated[Path, typer.Argument(help="A log that was cut short.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Without: FILE-recovered.mcap beside it.")
    ] = None,
    json: Json = False,
) -> None:
    """Write what is whole of a log that was cut short; the cut one stays as it is."""
    from services.logs.recover import recover as mend

    with _good_log():
        done = mend(file, out)
    if json:
        show_json(
            {
                "file": str(done.file),
                "messages": done.messages,
                "start_s": done.start,
                "end_s": done.end,
            }
        )
        return
    console.print(
        f"{done.messages} messages, {done.start:.3f} to {done.end:.3f} s, in {done.file}",
        highlight=False,
        soft_wrap=True,
    )


@log.command()
def export(
    file: File,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder; without: beside the log.")
    ] = None,
    format: Annotated[str, typer.Option(help="csv or parquet.")] = "csv",
    topic: Annotated[
        list[str] | None, typer.Option(help="Only this one; may be given several times.")
    ] = None,
    json: Json = False,
) -> None:
    """Write a log as tables, one file a topic, one row a message."""
    from services.logs.export import export as write
    from services.logs.file import BadLog

    source = _file(file)
    with _good_log():
        try:
            done = write(source, out or source.with_suffix(f".{format}.d"), format, topic or ())
        except BadLog:
            raise
        except ValueError as error:
            fail(str(error), 2)
    if json:
        show_json({str(path): rows for path, rows in done.items()})
        return
    for path, rows in done.items():
        console.print(f"{rows:9} rows  {path}", highlight=False, soft_wrap=True)


@log.command()
def plot(
    file: File,
    fields: Annotated[
        list[str],
        typer.Argument(help="What to draw: TOPIC:FIELD, as in robot/imu:gyro or robot/imu:gyro.2."),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Picture to write.")] = Path("plot.png"),
    start: Annotated[float, typer.Option("--from", help="From this time on [s].")] = 0.0,
    end: Annotated[float, typer.Option("--to", help="Until this time [s].")] = float("inf"),
) -> None:
    """Draw any numbers of a log over time, one panel a field."""
    from services.logs.plot import plot as draw

    if out.suffix.lower() not in (".png", ".svg", ".pdf"):
        fail(f"{out}: a picture is .png, .svg or .pdf", 2)
    with _good_log():
        draw(_file(file), fields, out, (start, end))
    console.print(f"picture in {out}", highlight=False, soft_wrap=True)
