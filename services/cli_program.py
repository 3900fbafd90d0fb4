"""``steadyhand program``: check a program, and have the running arm execute it."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from services import cli_requests
from services.cli_common import Json, show_json

program = typer.Typer(
    help="Programs of the arm (*.hds).", no_args_is_help=True, rich_markup_mode=None
)
for command in (
    cli_requests.start,
    cli_requests.stop,
    cli_requests.pause,
    cli_requests.resume,
):
    program.command()(command)


@program.command()
def check(
    files: Annotated[list[Path], typer.Argument(help="Files, or names in arm/programs.")],
    json: Json = False,
) -> None:
    """Check programs: all findings at once; exit code 1 if one of them must not run."""
    from arm.hds import Finding, ProgramError, load, render
    from arm.nodes import REGISTRY
    from deploy.task import find_program
    from deploy.tomlfile import BadFile

    found: list[Finding] = []
    for name in files:
        try:
            file = name if name.is_file() else find_program(str(name))
            found += load(file, REGISTRY).warnings
        except ProgramError as error:
            found += error.findings
        except (BadFile, OSError) as error:
            text = error.findings[0] if isinstance(error, BadFile) else str(error.strerror)
            text = text.removeprefix("task.program: ")
            found.append(Finding("error", "unreadable", text, str(name), 1, 1, 0))
    bad = any(f.severity == "error" for f in found)
    if json:
        show_json({"ok": not bad, "findings": [dataclasses.asdict(f) for f in found]})
    elif found:
        typer.echo(render(found))
    else:
        typer.echo(f"{len(files)} program{'s' if len(files) > 1 else ''}: no findings")
    raise typer.Exit(1 if bad else 0)
