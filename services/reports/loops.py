"""How late the loops of a live run were, over time."""

from __future__ import annotations

import itertools

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from services.logs.runlog import RunLog
from services.reports.curves import broken
from services.topics import HEALTH

SILENT = 1.0
"""Between two heartbeats that belong together [s]; five come a second."""

COLOURS = {
    "arm": "#1f4e9c",
    "observer": "#e08a1e",
    "sim": "#2e7d32",
    "base": "#8e44ad",
    "recorder": "0.55",
    "console": "#b3261e",
}


def loops(log: RunLog, title: str) -> Figure | None:
    """99 % and largest lateness of every service, a heartbeat a point; None without heartbeats."""
    beats = {name: [h for h in log.series(topic) if h.lateness] for name, topic in HEALTH.items()}
    beats = {name: found for name, found in beats.items() if len(found) > 1}
    if not beats:
        return None
    figure, (usual, worst) = plt.subplots(
        2, 1, figsize=(13, 5.5), sharex=True, sharey=True, layout="constrained"
    )
    for name, found in beats.items():
        t = np.array([h.t for h in found])
        colour = COLOURS.get(name, "black")
        for axis, key in ((usual, "p99"), (worst, "max")):
            late = np.array([max(1e3 * h.lateness[key], 1e-2) for h in found])
            axis.plot(*broken(t, late, hole=SILENT), color=colour, lw=1.0, label=name)
        again = [b.t for a, b in itertools.pairwise(found) if a.pid != b.pid]
        for at in again:
            worst.axvline(at, color=colour, ls=":", lw=1.2)
    usual.set(yscale="log", ylabel="late, 99 % of ticks [ms]")
    worst.set(ylabel="late, worst tick [ms]", xlabel="t [s] (dotted: restarted)")
    usual.legend(loc="upper right", ncols=len(beats), fontsize=8)
    figure.suptitle(title)
    return figure


def worst_of(log: RunLog, name: str) -> tuple[float, float, int] | None:
    """Median of the 99 % lateness, largest [ms], ticks missed; None if it was silent."""
    found = [h for h in log.series(HEALTH[name]) if h.lateness]
    if not found:
        return None
    p99 = 1e3 * float(np.median([h.lateness["p99"] for h in found]))
    return p99, 1e3 * max(h.lateness["max"] for h in found), found[-1].overruns
