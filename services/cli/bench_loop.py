"""``steadyhand bench loop``: how well the arm's loop keeps time, beside the bare machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from services.cli.common import Json, console, fail, show_json

if TYPE_CHECKING:
    from services.bench.loop import Block

MODES = ("auto", "on", "off")
ROWS: tuple[tuple[str, Callable[[Block], str]], ...] = (
    ("bare loop, lateness p99 [ms]", lambda b: f"{1e3 * b.timer['p99']:.3f}"),
    ("arm's loop, lateness p99 [ms]", lambda b: f"{1e3 * b.p99:.3f}"),
    ("longest [ms]", lambda b: f"{1e3 * b.longest:.1f}"),
    ("ticks later than 1 ms [%]", lambda b: f"{100 * b.late:.2f}"),
    ("ticks left out [%]", lambda b: f"{100 * b.missed:.2f}"),
    ("period, mean [ms]", lambda b: f"{1e3 * b.period[0]:.3f}"),
    ("period, standard deviation [ms]", lambda b: f"{1e3 * b.period[1]:.3f}"),
    ("bare round trip, median [ms]", lambda b: f"{1e3 * b.round_trip['p50']:.3f}"),
    ("bare round trip, p99 [ms]", lambda b: f"{1e3 * b.round_trip['p99']:.3f}"),
    ("state to command, median [ms]", lambda b: f"{1e3 * b.age['p50']:.3f}"),
    ("state to command, p99 [ms]", lambda b: f"{1e3 * b.age['p99']:.3f}"),
    ("... in bare round trips, p99", lambda b: f"{b.age_ratio:.2f}"),
    ("goals", lambda b: "[green]met[/]" if b.met else "[red]missed[/]"),
)


def loop(
    seconds: Annotated[float, typer.Option(min=3.0, help="Length of a block [s].")] = 30.0,
    rt: Annotated[list[str] | None, typer.Option(help="Set-ups: off, auto, on.")] = None,
    load: Annotated[str, typer.Option(help="Machine: quiet, busy or both.")] = "both",
    scenario: Annotated[str, typer.Option(help="What is drawn.")] = "whiteboard_moving",
    json: Json = False,
) -> None:
    """Period, lateness, ticks left out and age of the arm's answers; live, so run nothing else.

    Beside each block, in the same run: a loop that does nothing, and a bare round trip over Zenoh.
    Busy: a program that never rests on every core. Exit code 1 if a goal is missed on a quiet
    machine.
    """
    from services.bench.loop import AGE, LATE, MISSED, as_figures, measure
    from services.script import Silent

    modes = tuple(rt or ("off", "auto", "on"))
    if wrong := [mode for mode in modes if mode not in MODES]:
        fail(f"--rt is one of {', '.join(MODES)}, not {wrong[0]!r}", 2)
    loads = {"quiet": (False,), "busy": (True,), "both": (False, True)}
    if load not in loads:
        fail(f"--load is one of {', '.join(loads)}, not {load!r}", 2)

    blocks: list[Block] = []
    stopped = False

    def tell(block: Block) -> None:
        blocks.append(block)
        if not json:
            word = "busy" if block.busy else "quiet"
            console.print(f"--rt {block.rt}, {word} machine: done", highlight=False)

    try:
        measure(scenario, modes, loads[load], seconds, tell)
    except (Silent, TimeoutError) as error:
        fail(str(error))
    except KeyboardInterrupt:
        stopped = True
    if json:
        show_json({"blocks": as_figures(blocks)})
    elif blocks:
        table = Table("", *(f"--rt {b.rt}\n{'busy' if b.busy else 'quiet'}" for b in blocks))
        for label, shown in ROWS:
            table.add_row(label.replace("[", "\\["), *(shown(b) for b in blocks))
        console.print(table)
        console.print(
            f"goals: later than 1 ms at most {LATE:g} of the ticks, left out {MISSED:g}, "
            f"state to command {AGE:g} bare round trips",
            highlight=False,
        )
    if stopped:
        of = "shown are these" if blocks else "nothing is kept"
        fail(f"stopped after {len(blocks)} of {len(modes) * len(loads[load])} blocks; {of}", 130)
    raise typer.Exit(0 if all(b.met for b in blocks if not b.busy) else 1)
