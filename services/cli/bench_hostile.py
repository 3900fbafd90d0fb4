"""``steadyhand bench hostile``: a live arm in a flood of bad messages."""

from __future__ import annotations

from statistics import median
from typing import Annotated, Any

import typer
from rich.table import Table

from services.cli.common import Json, console, fail, show_json

GOAL = 1.5
"""The arm's loop is at most so many times as late under a flood."""


def hostile(
    messages: Annotated[int, typer.Option(min=1, help="How many to send.")] = 50_000,
    rate: Annotated[float, typer.Option(min=100, help="Of the flood [1/s].")] = 5000.0,
    profile: Annotated[
        str, typer.Option(help="open: over the local socket; secure: over TLS, as a watcher.")
    ] = "open",
    seed: Annotated[int, typer.Option(min=0, help="Of what is sent.")] = 0,
    json: Json = False,
) -> None:
    """Flood a live arm with junk, lies and requests; exit code 1 if anything was accepted.

    Blocks of 5 s of quiet and of flood take turns, so that both see the same machine. Lateness is
    that of the arm's 1 kHz loop, the median of its heartbeats' 99th percentiles; whether its ratio
    meets the goal depends on the machine, and does not change the exit code.
    """
    from services.bench.hostile import flood_arm

    if profile not in ("open", "secure"):
        fail(f"--profile is open or secure, not {profile!r}", 2)

    def told(sent: int) -> None:
        if not json:
            console.print(f"{sent} of {messages} sent", highlight=False)

    done = flood_arm(messages, rate, profile, seed, told)  # type: ignore[arg-type]
    if not done.quiet or not done.flooded:
        fail("the arm's heartbeat was not heard during the flood")
    figures: dict[str, Any] = {
        "profile": profile,
        "sent": done.sent,
        "accepted": done.accepted,
        "alive": done.alive,
        "lateness p99, quiet [ms]": 1e3 * median(done.quiet),
        "lateness p99, flooded [ms]": 1e3 * median(done.flooded),
        "ratio": done.ratio,
        "goal": f"<= {GOAL}, {'met' if done.ratio <= GOAL else 'MISSED'}",
        "refused in Python": sum(done.refused.values()),
    }
    if json:
        show_json(figures | {"refused": done.refused})
    else:
        table = Table(show_header=False, title="hostile input")
        for name, value in figures.items():
            shown = f"{value:.3g}" if isinstance(value, float) else str(value)
            table.add_row(name.replace("[", "\\["), shown)
        console.print(table)
    raise typer.Exit(0 if done.accepted == 0 and done.alive else 1)
