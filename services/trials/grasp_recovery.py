"""How often the grasp recovers from pushes, by variant and size of the push.

A trial is every variant under every size, pushed on the same body, in the same direction, at the
same phase of the task: differences are of the variants.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from matplotlib.figure import Figure

from services.reports.style import DRAWN, ERROR, MEANT
from services.trials.experiment import Row
from services.trials.lines import Line, share, worst

VARIANTS = ("sequential", "funnel", "parallel", "sum")
KEPT = ("success", "end", "off_table", "pushed_s", "peak_force_n", "fell_back", "tilt_end_deg")
"""Of a trial's figures, what a cell of the table is made of."""
COLOURS = dict(zip(VARIANTS, (DRAWN, ERROR, MEANT, "0.5"), strict=True))


def cells(
    variants: Iterable[str], sizes: Sequence[float], one: Callable[[str, float], Row]
) -> list[Row]:
    """Run a trial's cells.

    Args:
        variants: in the order of the table.
        sizes: of the push [N s].
        one: figures of a variant under a push.
    """
    return [
        {"variant": v, "impulse": size} | {key: whole[key] for key in KEPT}
        for v in variants
        for size in sizes
        for whole in [one(v, size)]
    ]


def table(rows: list[Row]) -> list[Line]:
    """Recovered, off the table and hardest force, of those that were pushed, by cell."""
    lines = []
    for (variant, size), mine in _sorted(rows).items():
        label = f"{variant}, {size:g} N s"
        stood = [c for c in mine if not c["off_table"]]
        lines += [
            share(f"{label}: lifted, of those left on the table", (c["success"] for c in stood)),
            share(f"{label}: off the table", (c["off_table"] for c in mine), least=False),
            worst(f"{label}: palm force, peak [N]", (c["peak_force_n"] for c in mine), goal=100.0),
        ]
    return lines


def picture(rows: list[Row]) -> Figure | None:
    """Recovered by size of the push, a line a variant, with its interval; None without a push."""
    import matplotlib.pyplot as plt

    found = _sorted(rows)
    if not found:
        return None
    figure, axis = plt.subplots(figsize=(5.6, 3.8), layout="constrained")
    for variant in dict.fromkeys(v for v, _ in found):
        points = []
        for (name, size), mine in found.items():
            line = share("", (c["success"] for c in mine if not c["off_table"]))
            if name == variant and line.value is not None:
                points.append((size, line.value, line.low or 0.0, line.high or 0.0))
        if points:
            x, y, low, high = zip(*sorted(points), strict=True)
            axis.plot(x, y, "o-", color=COLOURS[variant], label=variant)
            axis.fill_between(x, low, high, color=COLOURS[variant], alpha=0.15, lw=0)
    axis.set(xlabel="push over 0.1 s [N s]", ylabel="lifted, of those left on the table")
    axis.set_ylim(-0.03, 1.03)
    axis.legend(loc="lower left")
    return figure


def _sorted(rows: list[Row]) -> dict[tuple[str, float], list[dict[str, Any]]]:
    """Cells of all trials by variant and size; without a push in time there was nothing to try."""
    found: dict[tuple[str, float], list[dict[str, Any]]] = {}
    for row in rows:
        for cell in row["cells"]:
            if cell["pushed_s"] is not None:
                found.setdefault((cell["variant"], cell["impulse"]), []).append(cell)
    return found
