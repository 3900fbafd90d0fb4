"""Pictures of grasp experiments, after Figs 4.4 to 4.15 of Platt's thesis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from services.reports.style import DRAWN, ERROR, MEANT, save

WIDTH = 0.08
"""Of the kernel of a density [rad]."""


def pictures(rows: Sequence[Mapping[str, Any]], folder: Path) -> list[Path]:
    """Orientation before and after; mean residuals of reaches that converged, and of the others."""
    tries = [curve for row in rows for curve in row["curves"]]
    groups = {
        "converged": [c for c in tries if c["end"] == "converged"],
        "not_converged": [c for c in tries if c["end"] != "converged"],
    }
    drawn: list[tuple[str, Figure | None]] = [("orientation", orientation(rows))]
    drawn += [
        (f"residuals_{name}", residuals(c, name) if c else None) for name, c in groups.items()
    ]
    return save(folder, drawn)


def orientation(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Densities of the angle to the object's axis, as in Figs 4.4, 4.8, 4.12 and 4.13."""
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2), sharex=True, layout="constrained")
    names = (("angle_before", "when all touched"), ("angle_after", "when converged"))
    for axis, (key, title) in zip(axes, names, strict=True):
        values = [row[key] for row in rows if row[key] is not None]
        at = np.linspace(0.0, np.pi / 2, 200)
        axis.plot(at, density(values, at), color=DRAWN, lw=1.8)
        axis.plot(values, np.zeros(len(values)), "|", color=MEANT, alpha=0.7)
        axis.set_title(f"{title} (n = {len(values)})")
        axis.set_xlabel("angle to the axis [rad]")
    axes[0].set_ylabel("density")
    return figure


def density(values: Sequence[float], at: np.ndarray) -> np.ndarray:
    """Kernel density of angles folded to [0, pi/2], reflected at both ends."""
    if not values:
        return np.zeros_like(at)
    v = np.array(values)
    v = np.concatenate([v, -v, np.pi - v])
    kernels = np.exp(-0.5 * ((at[:, None] - v) / WIDTH) ** 2)
    return np.asarray(kernels.sum(axis=1) / (len(values) * WIDTH * np.sqrt(2.0 * np.pi)))


def residuals(curves: Sequence[Mapping[str, Any]], title: str) -> Figure:
    """Mean force and moment residual by update, as in Figs 4.6, 4.7, 4.10, 4.11, 4.14 and 4.15."""
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
    longest = max(len(c["rho"]) for c in curves)
    for axis, key, name in zip(axes, ("rho", "moment"), ("|rho|", "|M| / r_c"), strict=True):
        # a run that is over keeps its last value, so that the mean stays one over all
        table = np.array([c[key] + [c[key][-1]] * (longest - len(c[key])) for c in curves])
        axis.plot(table.T, color=DRAWN, lw=0.5, alpha=0.25)
        axis.plot(table.mean(axis=0), color=ERROR, lw=2.0)
        axis.set_xlabel("update")
        axis.set_ylabel(name)
        axis.set_ylim(bottom=0.0)
    axes[0].set_title(f"{title.replace('_', ' ')} (n = {len(curves)})")
    return figure
