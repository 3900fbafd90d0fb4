"""``steadyhand program``: check a program, and have the running arm execute it."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from services.cli import program_look as cli_program_look
from services.cli import requests as cli_requests
from services.cli.common import Json, fail, show_json

if TYPE_CHECKING:
    from arm.hds import Parameter

program = typer.Typer(
    help="Programs of arm and platform (*.hds).", no_args_is_help=True, rich_markup_mode=None
)
for name, command in cli_requests.PROGRAM.items():
    program.command(name)(command)
for command in cli_program_look.COMMANDS:
    program.command()(command)


@program.command()
def check(
    files: Annotated[
        list[Path], typer.Argument(help="Files, or names in arm/programs or base/programs.")
    ],
    json: Json = False,
    control: Annotated[
        bool, typer.Option("--control", help="Also run them in simulation: do nodes prepare?")
    ] = False,
    samples: Annotated[int, typer.Option(min=1, help="Runs a program, with --control.")] = 30,
    seed: Annotated[int, typer.Option(min=0, help="Of the first run.")] = 0,
    scenario: Annotated[
        str | None, typer.Option(help="To run in; by default the one made for the program.")
    ] = None,
) -> None:
    """Check programs: all findings at once; exit code 1 if one of them must not run."""
    from arm.hds import Finding, ProgramError, load, render
    from services.programs.kinds import kind_of

    found: list[Finding] = []
    for name in files:
        try:
            file = _file(name)
            kind = kind_of(file)
            if control and kind.owner != "arm":
                fail(f"{name}: control conditions are those of the arm's node types", 2)
            made = load(file, kind.registry)
            found += [*made.warnings, *kind.unusable(made)]
        except ProgramError as error:
            found += error.findings
        except OSError as error:
            text = error.strerror or str(error)
            found.append(Finding("error", "unreadable", text, str(name), 0, 0, 0))
    bad = any(f.severity == "error" for f in found)
    if control and not bad:
        from services.cli.program_control import check_control

        check_control([_file(name) for name in files], found, samples, seed, scenario, json)
    if json:
        show_json({"ok": not bad, "findings": [dataclasses.asdict(f) for f in found]})
    elif found:
        typer.echo(render(found))
    else:
        typer.echo(f"{len(files)} program{'s' if len(files) > 1 else ''}: no findings")
    raise typer.Exit(1 if bad else 0)


def _file(name: Path) -> Path:
    """The file of a program given as a file or by name.

    Raises:
        OSError: there is none; the text says which there are.
    """
    if name.is_file():
        return name
    from deploy.tomlfile import BadFile  # takes a while to import
    from services.programs.kinds import find

    try:
        return find(name)
    except BadFile as error:
        raise OSError(error.findings[0]) from None


@program.command()
def types(
    owner: Annotated[str, typer.Argument(help="Whose: arm or platform.")] = "arm",
    json: Json = False,
) -> None:
    """List the node types with their parameters, units, ranges and events."""
    from services.programs import kinds as program_kinds

    try:
        registry = program_kinds.kind(owner).registry
    except ValueError as error:
        fail(str(error), 2)
    if json:
        show_json({name: dataclasses.asdict(kind) for name, kind in registry.items()})
        return
    for name, kind in registry.items():
        typer.echo(f"{name}: {kind.doc}")
        typer.echo(f"  raises {', '.join(event.name for event in kind.events)}")
        for p in kind.parameters:
            typer.echo(f"  {p.name:12} {_range(p):44} {p.doc}")
        guards = ", ".join(f"{q.name} [{q.unit}]" for q in kind.offers)
        typer.echo(f"  guards may look at {guards}")


def _plainly(value: float) -> str:
    """Without what units leave behind the second digit of a larger number."""
    return f"{value if abs(value) < 1.0 else round(value, 2):g}"


def _range(p: Parameter) -> str:
    """Range, unit and default of a parameter, as a person would write them."""
    unit = p.default_unit
    if p.kind == "word":
        text = " or ".join(p.choices) if p.choices else 'a word or "text"'
        return f"{text}, required" if p.default is None else f"{text}, default {p.default}"
    low, high = (_plainly(unit.from_si(x)) for x in (p.lo, p.hi))
    text = f"{low} to {high}"
    text += f" {unit.name}" if unit.name != "1" else ""
    if p.default is None:
        return f"{text}, required"
    if isinstance(p.default, str) or math.isinf(p.default):
        return text
    return f"{text}, default {_plainly(unit.from_si(p.default))}"
