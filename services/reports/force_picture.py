"""Picture of the pen's force on the board."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from services.logs.runlog import RunLog
from services.reports.curves import broken
from services.reports.evaluation import Stroke, arm_worked, strokes_of
from services.reports.style import DRAWN, MEANT, once, plt
from services.topics import TRUTH

Array = NDArray[np.float64]

STRETCHES, FINEST = 1200, 0.02
"""A spread is shown over so many stretches of a run, each at least so long [s]."""
TAIL = 0.01
"""Share of the samples beyond a spread, on either side."""


def force(log: RunLog, title: str) -> Figure | None:
    """Force of the pen on the board over time; strokes are shaded."""
    truth = log.series(TRUTH)
    if len(truth) < 2 or not arm_worked(log):
        return None
    recent = np.concatenate([x.recent[:, 3] for x in truth])
    t = np.concatenate([x.t + 0.001 * np.arange(-4, 1) for x in truth])
    moment, beyond = broken(t, recent)  # a mean over a hole is of two different times
    smooth = np.convolve(beyond, np.ones(20) / 20, mode="same")
    figure, axis = plt.subplots(figsize=(13, 4.5), layout="constrained")
    for s in strokes_of(log):
        _shade(axis, s)
    at, low, high = spread(t, recent)
    wide = 1e3 * (at[1] - at[0]) if len(at) > 1 else 1.0
    label = f"all but {100 * (2 * TAIL):g} % of the samples in {wide:.2g} ms"
    axis.fill_between(*broken(at, low, high), color="0.75", lw=0, label=label)
    axis.plot(moment, smooth, color=DRAWN, lw=0.9, label="mean over 20 ms")
    axis.set(xlabel="t [s]", ylabel="force on the board [N]")
    top = float(np.nanpercentile(smooth, 99.9)) * 1.6
    axis.set_ylim(-0.1, max(top, 1.0))
    once(axis)
    figure.suptitle(title)
    return figure


def spread(t: Array, values: Array) -> tuple[Array, Array, Array]:
    """What nearly all values lie between, in stretches as wide as the eye can tell apart.

    A line through every sample of a minute is a solid block, whatever it shows.

    Args:
        t: instants, shape (n,) [s].
        values: shape (n,).

    Returns:
        Middles of the stretches (k,) [s], lower and upper bounds (k,).
    """
    wide = max((t[-1] - t[0]) / STRETCHES, FINEST)
    count = max(round((t[-1] - t[0]) / wide), 1)
    which = np.minimum(((t - t[0]) / wide).astype(int), count - 1)
    starts = np.flatnonzero(np.diff(which, prepend=-1))
    pieces = np.split(values, starts[1:])
    low, high = np.array([np.quantile(p, (TAIL, 1.0 - TAIL)) for p in pieces]).T
    return t[0] + wide * (which[starts] + 0.5), low, high


def _shade(axis: Any, stroke: Stroke) -> None:
    axis.axvspan(stroke.t[0], stroke.t[-1], color=MEANT, alpha=0.15, lw=0)
    axis.plot(stroke.t, stroke.force_reference, color=MEANT, lw=1.5, label="set, while drawing")
