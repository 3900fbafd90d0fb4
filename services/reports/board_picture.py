"""Pictures of the board: what was drawn against what was intended, and by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from services.logs.runlog import RunLog
from services.reports.curves import distance_to_path
from services.reports.evaluation import Stroke, strokes_of
from services.reports.style import DRAWN, MEANT, once, plt


def board(log: RunLog, title: str) -> Figure | None:
    """What was drawn against what was intended, and by how much it missed."""
    strokes = [s for s in strokes_of(log) if s.touching.any()]
    if not strokes:
        return None
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6), layout="constrained")
    for s in strokes:
        left.plot(*(1e3 * s.intended.T), color=MEANT, lw=5, alpha=0.5, label="intended")
        touched = np.where(s.touching[:, None], s.drawn, np.nan)
        left.plot(*(1e3 * touched.T), color=DRAWN, lw=1.2, label="drawn")
    _frame(left, strokes)
    once(left)
    left.set(aspect="equal", xlabel="$x_S$ [mm] (right)", ylabel="$y_S$ [mm] (up)", title="board")
    worst = 0.0
    for s in strokes:
        error = 1e3 * distance_to_path(s.drawn, s.intended)
        worst = max(worst, float(error[s.touching].max()))
        points = 1e3 * s.drawn
        lines = LineCollection(
            list(np.stack([points[:-1], points[1:]], axis=1)),
            cmap="viridis",
            array=np.where(s.touching, error, np.nan)[:-1],
            lw=3,
        )
        right.add_collection(lines)
    for collection in right.collections:
        collection.set_clim(0.0, max(worst, 1e-3))
    _frame(right, strokes)
    right.set(aspect="equal", xlabel="$x_S$ [mm]", title="distance to the intended line")
    figure.colorbar(right.collections[0], ax=right, label="[mm]", shrink=0.8)
    figure.suptitle(title)
    return figure


def drawing(log: RunLog, title: str) -> Figure | None:
    """What is on the board at the end: the drawn line, and nothing else."""
    strokes = [s for s in strokes_of(log) if s.touching.any()]
    if not strokes:
        return None
    lo, hi = (
        f([f(s.drawn[s.touching], axis=0) for s in strokes], axis=0) - m
        for f, m in ((np.min, 0.01), (np.max, -0.01))
    )
    width, height = np.maximum(hi - lo, 0.05)
    scale = 8.0 / max(width, height)
    figure = plt.figure(figsize=(scale * width, scale * height))
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    for s in strokes:
        touched = np.where(s.touching[:, None], s.drawn, np.nan)[::5]
        axis.plot(*touched.T, color="black", lw=1.3, solid_capstyle="round")
    axis.set(xlim=(lo[0], hi[0]), ylim=(lo[1], hi[1]), aspect="equal")
    axis.axis("off")
    return figure


def _frame(axis: Any, strokes: list[Stroke]) -> None:
    """Limits that show all that was drawn, wide enough for a single straight stroke."""
    points = 1e3 * np.concatenate([p for s in strokes for p in (s.intended, s.drawn[s.touching])])
    lo, hi = points.min(axis=0), points.max(axis=0)
    half = np.maximum(0.5 * (hi - lo), 0.35 * float((hi - lo).max())) * 1.15 + 1.0
    middle = 0.5 * (lo + hi)
    axis.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axis.set_ylim(middle[1] - half[1], middle[1] + half[1])
