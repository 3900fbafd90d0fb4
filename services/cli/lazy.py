"""Commands whose modules are imported when they are asked for: ``program check`` starts at once."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

COMMANDS = {
    "list": "services.cli.listing:list_",
    "up": "services.cli.up:up",
    "program": "services.cli.program:program",
    "bench": "services.cli.bench:bench",
    "arm": "services.cli.requests:arm",
    "base": "services.cli.requests:base",
    "run": "services.cli.run:run",
    "log": "services.cli.log:log",
    "replay": "services.cli.replay:replay",
    "report": "services.cli.report:report",
    "tune": "services.cli.replay:tune",
    "trials": "services.cli.trials:trials",
    "console": "services.cli.console:console_",
    "disturb": "services.cli.disturb:disturb",
    "watch": "services.cli.watch:watch",
    "hosts": "services.cli.hosts:hosts",
    "keys": "services.cli.keys:keys",
    "doctor": "services.cli.doctor:doctor",
}
"""Command to where it is: a function, or a group of commands."""


class LazyGroup(TyperGroup):
    """The commands that are registered, and those of ``COMMANDS``."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the order of the help text."""
        return [*super().list_commands(ctx), *COMMANDS]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of that name, or None."""
        if cmd_name not in COMMANDS:
            return super().get_command(ctx, cmd_name)
        module, _, attribute = COMMANDS[cmd_name].partition(":")
        found = getattr(import_module(module), attribute)
        if not isinstance(found, typer.Typer):
            alone = typer.Typer(rich_markup_mode=None, add_completion=False)
            alone.command(name=cmd_name)(found)
            found = alone
        command = typer.main.get_command(found)
        command.name = cmd_name
        return command
