"""Pictures of floating grasps, after Figs 4.4 to 4.15 of Platt's thesis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from services.reports.style import DRAWN, ERROR, MEANT
from services.trials.floating_run import EVERY, GOAL
from services.trials.lines import share

Cells = Sequence[Mapping[str, Any]]
COLOURS = ("#1f4e9c", "#6a94d4", "#e08a1e", "#f0c286", "#b3261e", "#3c7a3c", "#7a5c9e", "#888888")


def residual_curves(cells: Mapping[str, Cells], controller: str) -> Figure:
    """Mean residuals of the trials that succeeded and of those that did not, a column a case."""
    deep, wide = _grid(len(cells))
    figure, axes = plt.subplots(
        2 * deep, wide, figsize=(2.9 * wide, 4.4 * deep), sharex=True, sharey="row",
        squeeze=False, layout="constrained",
    )  # fmt: skip
    columns = axes.reshape(deep, 2, wide).transpose(0, 2, 1).reshape(-1, 2)
    for column, (case, trials) in zip(columns, cells.items(), strict=False):
        for found, colour in ((True, DRAWN), (False, ERROR)):
            group = [np.array(t["curve"]) for t in trials if t["success"] == found]
            if not group:
                continue
            many = _aligned(group)
            t = EVERY * np.arange(many.shape[1])
            label = f"{len(group)} {'good' if found else 'not'}"
            for axis, values in zip(column, many.transpose(2, 0, 1), strict=True):
                axis.plot(t, values.mean(axis=0), color=colour, label=label)
                axis.fill_between(
                    t, *np.quantile(values, [0.1, 0.9], axis=0), color=colour, alpha=0.15, lw=0
                )
        column[0].set_title(case)
        column[0].legend()
        column[1].set_xlabel("update")
        for axis in column:
            axis.axhline(GOAL, color="0.5", lw=0.8, ls=":")
    for unused in columns[len(cells) :].ravel():
        unused.set_axis_off()
    for row in range(deep):
        axes[2 * row, 0].set_ylabel("|ρ|")
        axes[2 * row + 1, 0].set_ylabel("|M| / r_c")
    figure.suptitle(f"mean residual, and 10 to 90 % of trials; {controller}")
    return figure


def densities(cells: Mapping[str, Cells], controller: str) -> Figure:
    """Orientation to the object's axis before and after, a panel a case."""
    deep, wide = _grid(len(cells))
    figure, axes = plt.subplots(
        deep, wide, figsize=(2.9 * wide, 2.7 * deep), squeeze=False, layout="constrained"
    )
    grid = np.linspace(0.0, np.pi / 2.0, 200)
    panels = axes.ravel()
    for axis, (case, trials) in zip(panels, cells.items(), strict=False):
        both = np.array([t["angle"] for t in trials])
        for values, colour, label in zip(both.T, (MEANT, DRAWN), ("before", "after"), strict=True):
            axis.plot(grid, density(values, grid), color=colour, label=label)
        axis.set_title(case)
        axis.set_xlabel("angle to the axis [rad]")
    for unused in panels[len(cells) :]:
        unused.set_axis_off()
    for row in axes:
        row[0].set_ylabel("density [1/rad]")
    panels[0].legend()
    figure.suptitle(f"line of two contacts, or normal of the plane of three; {controller}")
    return figure


def success(cells: Mapping[str, Mapping[str, Cells]]) -> Figure:
    """Share that converged, by case and controller, with 95 % intervals."""
    controllers = list(dict.fromkeys(c for case in cells.values() for c in case))
    figure, axis = plt.subplots(figsize=(1.4 * len(cells) + 2.0, 4.0), layout="constrained")
    wide = 0.8 / len(controllers)
    for i, controller in enumerate(controllers):
        for j, case in enumerate(cells.values()):
            if controller not in case:
                continue
            line = share("", (t["success"] for t in case[controller]))
            assert line.value is not None and line.low is not None and line.high is not None
            x = j - 0.4 + (i + 0.5) * wide
            colour = COLOURS[i % len(COLOURS)]
            axis.bar(x, line.value, wide, color=colour)
            axis.vlines(x, line.low, line.high, color="0.2", lw=1)
        axis.bar(0, 0, color=COLOURS[i % len(COLOURS)], label=controller)
    axis.set_xticks(range(len(cells)), [case.replace(" ", "\n", 1) for case in cells])
    axis.set_ylabel("converged")
    axis.legend(
        ncols=min(len(controllers), max(2, len(cells))),
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
    )
    return figure


def density(values: NDArray[np.float64], grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Kernel density of angles in [0, pi/2], mirrored at both ends so that nothing leaks out."""
    jitter = 1e-3 * np.linspace(-1.0, 1.0, len(values))  # all alike have no density
    mirrored = np.concatenate([values, -values, np.pi - values]) + np.tile(jitter, 3)
    width = max(0.06, 0.5 * float(np.std(values)) * len(values) ** -0.2)
    kernel = gaussian_kde(mirrored, bw_method=width / float(np.std(mirrored)))
    found: NDArray[np.float64] = 3.0 * kernel(grid)
    return found


def _grid(n: int) -> tuple[int, int]:
    """Rows and columns for so many panels."""
    deep = -(-n // 5)
    return deep, -(-n // deep)


def _aligned(curves: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Curves of unlike length, each held at its end, (n, longest, 2)."""
    longest = max(len(c) for c in curves)
    return np.array([np.vstack([c, np.tile(c[-1], (longest - len(c), 1))]) for c in curves])
