"""``steadyhand program explain, verify, graph, step``: look at a program without a robot."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from services.cli.common import Json, fail, show_json

if TYPE_CHECKING:
    from arm.hds import Program, Registry
    from arm.hds.sketch import Sketch

File = Annotated[Path, typer.Argument(help="A file, or a name in arm/programs or base/programs.")]


def load_or_fail(name: Path) -> tuple[Program, Registry]:
    """The checked program, and the node types of whoever it is for.

    Leaves with its findings and exit code 1 if it must not run.
    """
    from arm.hds import ProgramError, load
    from services.programs.kinds import kind_of

    try:
        file = find(name)
        registry = kind_of(file).registry
        return load(file, registry), registry
    except ProgramError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from None
    except OSError as error:
        fail(f"cannot read {name}: {error.strerror}")


def find(name: Path) -> Path:
    """The file of a program given as a file or by name; leaves with an error without one."""
    from deploy.tomlfile import BadFile
    from services.programs import kinds as program_kinds

    try:
        return program_kinds.find(name)
    except BadFile as error:
        fail(error.findings[0])


def explain(file: File, json: Json = False) -> None:
    """Print a program as H = (Q, X, I, f, E, G, T), its discrete part, and what it can do."""
    from arm.hds import explain as hds

    program, registry = load_or_fail(file)
    if json:
        show_json(hds.explanation(program, registry))
    else:
        typer.echo(hds.explain(program, registry))


def verify(
    file: File,
    spec: Annotated[Path, typer.Option(help="The specification.", exists=True, dir_okay=False)],
    abort: Annotated[bool, typer.Option(help="Let Abort happen in every node.")] = True,
    json: Json = False,
) -> None:
    """Does the program ever leave a specification? Exit code 1, and the shortest trace, if so."""
    from arm.hds import ProgramError, render
    from arm.hds.product import render_verdict, verify_program
    from arm.hds.specification_check import load_specification

    program, registry = load_or_fail(file)
    try:
        wanted = load_specification(spec, program, registry)
    except ProgramError as error:
        if json:
            found = [dataclasses.asdict(f) for f in error.findings]
            show_json({"holds": None, "findings": found})
        else:
            typer.echo(render(error.findings), err=True)
        raise typer.Exit(1) from None
    verdict = verify_program(program, registry, wanted, abort)
    if json:
        show_json(
            {
                "holds": verdict.holds,
                "violation": verdict.violation and dataclasses.asdict(verdict.violation),
                "pairs": sorted(verdict.pairs),
                "unreached": list(verdict.unreached),
            }
        )
    else:
        typer.echo(render_verdict(program, wanted, verdict))
    raise typer.Exit(0 if verdict.holds else 1)


def graph(
    file: File,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Where to; without, standard output.")
    ] = None,
    format: Annotated[
        str | None, typer.Option(help="svg, png, dot or mermaid; without, from the file's name.")
    ] = None,
    current: Annotated[str | None, typer.Option(help="Node to show as the current one.")] = None,
) -> None:
    """Draw a program; findings are red. One with errors is drawn as far as it can be read.

    Exit code 1 if it has errors; the picture is written all the same.
    """
    from arm.hds.diagram import dot, mermaid
    from arm.hds.svg import render

    endings = {".svg": "svg", ".png": "png", ".dot": "dot", ".gv": "dot", ".mmd": "mermaid"}
    kind = format or endings.get(out.suffix.lower() if out else ".svg", "")
    if kind not in ("svg", "png", "dot", "mermaid"):
        fail(f"no format {kind or out!s}. Known: svg, png, dot, mermaid; give --format", 2)
    sketch, bad = _sketch(find(file))
    names = [box.name for box in sketch.boxes]
    if current is not None and current not in names:
        from arm.hds.names import hint

        fail(f"there is no node '{current}'; {hint(current, names)}", 2)
    try:
        if kind == "png":
            from services.reports.program_picture import write_png

            if out is None:
                fail("a PNG needs a file: -o picture.png", 2)
            write_png(sketch, out, current)
        else:
            text = {"svg": render, "dot": dot, "mermaid": mermaid}[kind](sketch, current)
            if out is None:
                typer.echo(text, nl=False)
            else:
                out.write_text(text, encoding="utf-8")
    except OSError as error:
        fail(f"cannot write {out}: {error.strerror}")
    if bad:
        typer.echo(f"{file} has errors: steadyhand program check {file}", err=True)
    raise typer.Exit(1 if bad else 0)


def _sketch(file: Path) -> tuple[Sketch, bool]:
    """What to draw of a file, and whether it has errors."""
    from arm.hds import ProgramError, load
    from arm.hds.broken import broken_sketch
    from arm.hds.sketch import sketch
    from services.programs.kinds import kind_of

    registry = kind_of(file).registry
    try:
        return sketch(load(file, registry), registry), False
    except ProgramError as error:
        text = file.read_text(encoding="utf-8", errors="replace")
        return broken_sketch(text, str(file), error.findings), True
    except OSError as error:
        fail(f"cannot read {file}: {error.strerror}")


def step(
    file: File,
    events: Annotated[
        str, typer.Option(help="Instead of typing: events and quantities, with commas between.")
    ] = "",
) -> None:
    """Walk through a program by typed events, without a robot.

    Type an event, a quantity (Force 6 N), tick, back, restart, where or quit. Events may come from
    --events or from standard input. Exit code 0 if it ended in a terminal node or by quit; 1 if an
    event was refused, or the events were over before the end.
    """
    from arm.hds.walk import Refused, Walk, split_events

    walk = Walk(*load_or_fail(file))
    typer.echo(walk.where())
    if events or not sys.stdin.isatty():
        for line in split_events(events or sys.stdin.read()):
            try:
                typer.echo(walk.do(line))
            except Refused as refusal:
                fail(str(refusal))
            if walk.done:
                break
        if not walk.ended and not walk.done:
            fail(f"the events are over, and the program has not ended: it is in {walk.node}")
        return
    while not walk.done:
        try:
            typer.echo(walk.do(input(f"{walk.node}> ")))
        except Refused as refusal:
            typer.echo(f"refused: {refusal}")
        except (EOFError, KeyboardInterrupt):
            return


COMMANDS = (explain, verify, graph, step)
