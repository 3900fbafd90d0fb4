"""``steadyhand``: the command line. Exit codes: 0 done, 1 not done, 2 wrongly asked."""

from __future__ import annotations

import sys
from typing import Annotated

import typer
from rich.markup import escape

from services.cli.common import errors
from services.cli.lazy import LazyGroup

app = typer.Typer(
    cls=LazyGroup,
    rich_markup_mode=None,  # it would take units in brackets for markup
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _tell_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"steadyhand {version('steadyhand')}")
        raise typer.Exit


@app.callback()
def steadyhand(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Say it.")
    ] = False,
) -> None:
    """Robot software for hands that stay steady on moving bases."""


def main() -> None:
    """Entry point: errors people can do something about come without a traceback."""
    try:
        app()
    except (ValueError, RuntimeError) as error:
        from deploy.tomlfile import BadFile
        from services.live.supervisor import AlreadyRunning, StartFailed
        from services.wire.endpoints import BadEndpoint

        if not isinstance(error, BadFile | BadEndpoint | AlreadyRunning | StartFailed):
            raise
        errors.print("[bold red]error:[/]", escape(str(error)), highlight=False)
        sys.exit(2 if isinstance(error, BadFile) else 1)
