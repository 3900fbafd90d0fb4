"""``steadyhand program``: check a program, and have the running arm execute it."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from services import cli_requests
from services.cli_common import Json, fail, show_json

program = typer.Typer(help="Programs of the arm (*.hds).", no_args_is_help=True)
for command in (
    cli_requests.start,
    cli_requests.stop,
    cli_requests.pause,
    cli_requests.resume,
):
    program.command()(command)


@program.command()
def check(
    files: Annotated[list[Path], typer.Argument(help="Programs to check.")], json: Json = False
) -> None:
    """Check programs: all findings at once; exit code 1 if one of them must not run."""
    from arm.hds import Finding, check_text, render
    from arm.nodes import REGISTRY

    found: list[Finding] = []
    bad = False
    for file in files:
        try:
            text = file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            fail(f"cannot read {file}: {error}")
        checked, findings = check_text(text, str(file), REGISTRY)
        found += findings
        bad |= checked is None or any(f.severity == "error" for f in findings)
    if json:
        show_json({"ok": not bad, "findings": [dataclasses.asdict(f) for f in found]})
    elif found:
        typer.echo(render(found))
    else:
        typer.echo(f"{len(files)} program{'s' if len(files) > 1 else ''}: no findings")
    raise typer.Exit(1 if bad else 0)
