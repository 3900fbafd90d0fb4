"""``steadyhand bench soak``: a live robot for long; does anything grow?"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import Progress
from rich.table import Table

from services.cli.common import Json, console, fail, show_json


def soak(
    minutes: Annotated[float, typer.Option(min=0.2, help="How long.")] = 60.0,
    seed: Annotated[int, typer.Option(min=0, help="Of the disturbances.")] = 0,
    scenario: Annotated[str, typer.Option(help="What is drawn.")] = "whiteboard_moving",
    out: Annotated[Path | None, typer.Option(help="Picture (.png, .svg, .pdf).")] = None,
    json: Json = False,
) -> None:
    """Memory, handles, threads and lateness of a live robot that is pushed every 15 s.

    The first quarter is warm-up. Exit code 1 if a process but the recorder grows by more than
    1 MB/h.
    """
    from services.bench.soak import figures, picture
    from services.bench.soak import soak as run
    from services.script import Silent

    with (
        tempfile.TemporaryDirectory(prefix="shs") as folder,
        Progress(console=console, disable=json, transient=True) as progress,
    ):
        task = progress.add_task("soaking", total=60.0 * minutes)
        try:
            found = run(
                Path(folder) / "r", scenario, 60.0 * minutes, seed,
                lambda now: progress.update(task, completed=now),
            )  # fmt: skip
        except (Silent, TimeoutError) as error:
            fail(str(error))
    result = figures(found)
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        picture(found).savefig(out, dpi=110)
    if json:
        show_json(result)
    else:
        _show(result)
    raise typer.Exit(0 if result["met"] else 1)


def _show(result: dict[str, Any]) -> None:
    table = Table("process", "own memory\n\\[MB]", "growth\n\\[MB/h]", "handles", "threads")
    for name, row in result["services"].items():
        growth = row["memory_mb_per_h"]
        table.add_row(
            name, f"{row['memory_mb']:.1f}", "restarted" if growth is None else f"{growth:.2f}",
            "{} to {}".format(*row["handles"]), "{} to {}".format(*row["threads"]),
        )  # fmt: skip
    console.print(table)
    first, second = result["arm_p99_ms"]
    console.print(
        f"arm p99 late {first:.3f} ms in the first half, {second:.3f} ms in the second; "
        f"{result['disturbances']} pushes; interrupted {len(result['interruptions'])} times",
        highlight=False,
    )
    console.print(
        f"log {result['log_mb_per_min']:.1f} MB a minute, "
        f"{sum(result['lost'].values())} messages of it lost",
        highlight=False,
    )
    for word in result["interruptions"][:10]:
        console.print(f"  {word}", highlight=False)
