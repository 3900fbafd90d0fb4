"""``steadyhand report``: the story of a run in one HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from services.cli.common import console, fail, writing
from services.cli.progress import busy


def report(
    log: Annotated[Path, typer.Argument(help="A log (.mcap), or the folder of a run.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File; without: report.html beside the log.")
    ] = None,
) -> None:
    """Write one self-contained page: figures and pictures of a run, each with what it shows."""
    from services.logs.runlog import BadLog, read_run

    target = out or (log if log.is_dir() else log.parent) / "report.html"
    try:
        with busy("reading the log"):
            messages, about, notes = read_run(log)
    except (BadLog, OSError) as error:
        fail(str(error), 2)
    if not any(messages.messages.values()):
        fail(f"{log}: no messages in it: there is nothing to report", 2)
    from services.reports.html import html_of

    run = log if log.is_dir() else log.parent
    name = about.get("scenario") or run.resolve().name
    title = f"{name}, {about.get('mode', 'run')}, observer {about.get('observer', '?')}"
    with busy("drawing the pictures"):
        page = html_of(messages, about, notes, f"{title}, seed {about.get('seed', '?')}")
    with writing():
        target.write_text(page, encoding="utf-8")
    console.print(f"report in {target}", highlight=False, soft_wrap=True)
