"""Pictures of grasp trials, after Figs 4, 6, 7 and 8 of Platt et al."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from services.reports.report import DRAWN, ERROR, MEANT

BOX = (0.203, 0.279)
"""Depth and width [m]."""
PALM = 0.055
"""Half of a palm along its fingers [m]."""
PALMS = ("left_palm", "right_palm")
LETTERS = "ABCD"


def palms(row: Mapping[str, Any]) -> Figure:
    """Fig 4: both palms as paddles at the start (A), after reach (B), touch (C), comply (D)."""
    figure, axis = plt.subplots(figsize=(5, 5), layout="constrained")
    _box(axis)
    t = np.array(row["paths"]["t"])[:, 0]
    times = moments(row, t)
    for name, colour in zip(PALMS, (DRAWN, MEANT), strict=True):
        path = np.array(row["paths"][name])
        axis.plot(-path[:, 1], path[:, 0], color=colour, lw=0.8, alpha=0.6)
        for letter, moment in zip(LETTERS, times, strict=False):
            x, y, dx, dy = path[int(np.argmin(np.abs(t - moment)))]
            a = np.array([[-(y - PALM * dy), x - PALM * dx], [-(y + PALM * dy), x + PALM * dx]])
            axis.plot(*a.T, color=colour, lw=3)
            axis.annotate(letter, (-y, x), textcoords="offset points", xytext=(6, -3))
    _square(axis, "palms while they grasp")
    return figure


def moments(row: Mapping[str, Any], t: np.ndarray) -> list[float]:
    """Start of the reach, half and three quarters of the way to the lift, the lift [s]."""
    start = row["start_s"] or 0.0
    took = row["grasp_s"] or float(t[-1]) - start
    return [start, start + 0.55 * took, start + 0.85 * took, start + took]


def overhead(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Fig 6: platform and palms over the floor, the box at the origin."""
    figure, axis = plt.subplots(figsize=(6, 5), layout="constrained")
    axis.add_patch(Rectangle((-BOX[0] / 2, -BOX[1] / 2), *BOX, fill=False))
    for row in rows:
        base = np.array(row["paths"]["base"])
        axis.plot(base[:, 0], base[:, 1], color=DRAWN, lw=1)
        for name in PALMS:
            path = np.array(row["paths"][name])
            started = np.array(row["paths"]["t"])[:, 0] >= (row["start_s"] or 0.0)
            axis.plot(path[started, 0], path[started, 1], color=MEANT, lw=1)
    _square(axis, "paths of platform and palms")
    return figure


def variances(stages: Mapping[str, np.ndarray]) -> Figure:
    """Fig 7: variance of the estimated box pose by stage, as measured and as stated."""
    figure, axes = plt.subplots(1, 3, figsize=(10, 3.4), layout="constrained")
    where = np.arange(len(stages))
    for i, (axis, label) in enumerate(
        zip(axes, ("x [mm²]", "y [mm²]", "yaw [mrad²]"), strict=True)
    ):
        measured = [float(np.mean(v[:, i] ** 2)) for v in stages.values()]
        stated = [float(np.mean(v[:, i + 3] ** 2)) for v in stages.values()]
        axis.bar(where - 0.2, measured, 0.4, color=DRAWN, label="of the error")
        axis.bar(where + 0.2, stated, 0.4, color=ERROR, alpha=0.5, label="stated")
        axis.set_yscale("log")
        axis.set_xticks(where, list(stages))
        axis.set_title(f"variance, {label}")
    axes[0].legend()
    return figure


def palm_paths(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Fig 8: paths of the palms, seen from above."""
    figure, axis = plt.subplots(figsize=(5, 5), layout="constrained")
    _box(axis)
    for row in rows:
        t = np.array(row["paths"]["t"])[:, 0]
        started = t >= (row["start_s"] or 0.0)
        for name, colour in zip(PALMS, (DRAWN, MEANT), strict=True):
            path = np.array(row["paths"][name])[started]
            axis.plot(-path[:, 1], path[:, 0], color=colour, lw=1)
    _square(axis, f"palm paths of {len(rows)} trials")
    return figure


def _box(axis: Axes) -> None:
    axis.add_patch(Rectangle((-BOX[1] / 2, -BOX[0] / 2), BOX[1], BOX[0], fill=False))


def _square(axis: Axes, title: str) -> None:
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set_title(title)
    axis.set_xlabel("[m]")
    axis.set_ylabel("[m]")
