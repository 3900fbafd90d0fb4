"""``steadyhand bench console``: what console and recorder cost the arm's loop, in one run."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from services.bench import console as console_bench
from services.cli.common import Json, console, fail, show_json
from services.requests import NoAnswer


def console_(
    scenario: Annotated[str, typer.Option(help="Name or file.")] = "whiteboard_moving",
    pairs: Annotated[int, typer.Option(min=2, help="Blocks with, and as many without.")] = 6,
    seconds: Annotated[float, typer.Option(min=2.0, help="Length of a block [s].")] = 10.0,
    rt: Annotated[str, typer.Option(help="Real-time priority and cores: auto, on, off.")] = "auto",
    beside: Annotated[str, typer.Option(help="Which: both, console or recorder.")] = "both",
    json: Json = False,
) -> None:
    """Lateness of the arm's ticks with console (no browser) and recorder, and without.

    Live, so the machine must be otherwise idle. Exit code 1 if the goal is missed.
    """
    from deploy.tomlfile import BadFile
    from sim.scenario import load_scenario

    if rt not in ("auto", "on", "off"):
        fail(f"--rt is auto, on or off, not {rt!r}", 2)
    if beside not in ("both", *console_bench.BESIDE):
        fail(f"--beside is both, {' or '.join(console_bench.BESIDE)}, not {beside!r}", 2)
    which = console_bench.BESIDE if beside == "both" else (beside,)
    try:
        loaded = load_scenario(scenario)
    except BadFile as error:
        fail(str(error), 2)

    def tell(block: console_bench.Block) -> None:
        if not json:
            word = "with   " if block.on else "without"
            console.print(
                f"{word} p99 {block.p99 * 1e3:.3f} ms, longest {block.longest * 1e3:.2f} ms, "
                f"{block.missed} missed, {block.beats} heartbeats",
                highlight=False,
            )

    try:
        found = console_bench.measure(loaded, pairs, seconds, rt, tell, which)
    except NoAnswer as error:
        fail(str(error))
    if json:
        show_json(found)
    else:
        table = Table("arm loop", "without", "with", "ratio", "goal", "")
        ratio = "-" if found["ratio"] is None else f"{found['ratio']:.2f}"
        verdict = "[green]met[/]" if found["met"] else "[red]missed[/]"
        table.add_row(
            "p99 lateness [ms]",
            f"{found['p99_without_ms']:.3f}",
            f"{found['p99_with_ms']:.3f}",
            ratio,
            f"≤ {found['goal']:g}",
            verdict,
        )
        console.print(table)
    raise typer.Exit(0 if found["met"] else 1)
