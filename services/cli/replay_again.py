"""``steadyhand replay``: what a service says again, beside what it said in the run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from services.cli.common import console, fail, show_json

if TYPE_CHECKING:
    from services.replays.again import Again, Compared


def again(log: Path, service: str) -> Again:
    """Run a service of a recorded run again; leaves with an error if that cannot be."""
    from arm.hds import ProgramError
    from deploy.tomlfile import BadFile
    from services.logs.runlog import BadLog, read_run
    from services.replays.again import run_again

    try:
        messages, about, notes = read_run(log)
        done = run_again(messages, about, service)
    except (BadFile, BadLog, ProgramError, OSError) as error:
        fail(str(error), 2)
    done.notes[:0] = notes
    return done


def show_again(done: Again, json: bool) -> None:
    """Print how far a service agrees with the log; exit code 1 where it should and does not.

    Of a run in lockstep every bit should agree; of a live one the arm's states and nodes.
    """
    if json:
        show_json(data_of(done))
    else:
        if done.transitions[0]:
            console.print(_transitions(done))
        show_lines(done)
    raise typer.Exit(0 if (done.agrees if done.exact else done.decides_alike) else 1)


def show_lines(done: Again) -> None:
    """Print one line a topic, and below them what people should know of the comparison."""
    for line in lines_of(done):
        console.print(line, highlight=False, soft_wrap=True)
    for note in done.notes:
        console.print(f"[dim]note[/]  {escape(note)}", highlight=False, soft_wrap=True)


def lines_of(done: Again) -> list[str]:
    """One line a topic."""
    out = []
    for c in done.compared.values():
        colour = "green" if c.agrees else "yellow"
        line = f"[{colour}]{c.topic}[/]: {c.same} of {c.then} as in the log, to the last bit"
        missing = c.then - c.now
        line += f"; {missing} not said again" if missing else ""
        line += f"; {c.more} said that were not said then" if c.more else ""
        out.append(line + _largest(c))
    return out


def _largest(c: Compared) -> str:
    parts = [
        f"{name} {'differs' if math.isinf(size) else f'by {size:.3g}'} at {t:.3f} s"
        for name, (size, t) in c.largest.items()
    ]
    return f"; most: {', '.join(parts)}" if parts else ""


def _transitions(done: Again) -> Table:
    """Nodes of the log beside those of the replay."""
    then, now = done.transitions
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for head in ("state and node in the log", "at [s]", "again at [s]", ""):
        table.add_column(escape(head), justify="right" if "[s]" in head else "left")
    for k in range(max(len(then), len(now))):
        a = then[k] if k < len(then) else None
        b = now[k] if k < len(now) else None
        name = f"{a.state} {a.node}" if a else ""
        same = a is not None and b is not None and (a.state, a.node) == (b.state, b.node)
        other = "" if same else f"{b.state} {b.node}" if b else "not reached"
        table.add_row(name, f"{a.t:.3f}" if a else "", f"{b.t:.3f}" if b else "", other)
    return table


def data_of(done: Again) -> dict[str, Any]:
    """The same as plain data."""
    return {
        "service": done.service,
        "exact": done.exact,
        "agrees": done.agrees,
        "decides_alike": done.decides_alike,
        "until_s": done.end,
        "topics": {
            c.topic: {
                "log": c.then,
                "again": c.now,
                "same": c.same,
                "more": c.more,
                "largest": {
                    name: {"by": size if math.isfinite(size) else None, "at_s": t}
                    for name, (size, t) in c.largest.items()
                },
            }
            for c in done.compared.values()
        },
        "transitions": {
            side: [{"t": t.t, "state": t.state, "node": t.node} for t in found]
            for side, found in zip(("log", "again"), done.transitions, strict=True)
        },
        "notes": done.notes,
    }
