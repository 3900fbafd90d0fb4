"""Pictures of grasp trials, after Figs 4, 6, 7 and 8 of Platt et al."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from services.reports.style import DRAWN, ERROR, MEANT

BOX = (0.203, 0.279)
"""Depth and width [m]."""
PALM = 0.055
"""Half of a palm along its fingers [m]."""
PALMS = ("left_palm", "right_palm")
LETTERS = "ABCD"


def palms(row: Mapping[str, Any]) -> Figure:
    """Fig 4: both palms as paddles at the start (A), on the line (B), touching (C), flat (D)."""
    figure, axis = plt.subplots(figsize=(6, 5), layout="constrained")
    _box(axis)
    t = np.array(row["paths"]["t"])[:, 0]
    grasping = t >= row["moments"][0]
    for name, colour in zip(PALMS, (DRAWN, MEANT), strict=True):
        path = np.array(row["paths"][name])
        axis.plot(-path[grasping, 1], path[grasping, 0], color=colour, lw=0.8, alpha=0.6)
        for letter, moment in zip(LETTERS, row["moments"], strict=True):
            x, y, dx, dy = path[int(np.argmin(np.abs(t - moment)))]
            a = np.array([[-(y - PALM * dy), x - PALM * dx], [-(y + PALM * dy), x + PALM * dx]])
            axis.plot(*a.T, color=colour, lw=3)
            outside = -16 if name == PALMS[0] else 8
            at = {"B": (*a.mean(axis=0), outside, -3), "C": (*a[0], -3, -12)}
            *end, right, up = at.get(letter, (*a[1], -3, 4))
            axis.annotate(letter, end, textcoords="offset points", xytext=(right, up))
    _square(axis, "palms: A start, B on the line, C touching, D flat")
    return figure


def overhead(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Fig 6: platform and palms over the floor, the box at the origin."""
    figure, axis = plt.subplots(figsize=(6, 5), layout="constrained")
    axis.add_patch(Rectangle((-BOX[0] / 2, -BOX[1] / 2), *BOX, fill=False, label="box"))
    axis.plot([], [], "o-", color=DRAWN, lw=1, ms=4, label="middle of the platform, from its start")
    axis.plot([], [], color=MEANT, lw=1, label="palms, from when they reach")
    for row in rows:
        base = np.array(row["paths"]["base"])
        axis.plot(base[:, 0], base[:, 1], color=DRAWN, lw=1)
        axis.plot(*base[0, :2], "o", color=DRAWN, ms=4)
        for name in PALMS:
            path = np.array(row["paths"][name])
            started = np.array(row["paths"]["t"])[:, 0] >= (row["start_s"] or 0.0)
            axis.plot(path[started, 0], path[started, 1], color=MEANT, lw=1)
    _square(axis, "paths of platform and palms, from above")
    figure.legend(loc="outside lower center", ncols=2, fontsize="small")
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
        ends = np.log10([min(measured + stated), max(measured + stated)])
        # bars from a whole decade, so far down that the smallest is seen
        axis.set_ylim(10.0 ** np.floor(ends[0] - 0.3), 10.0 ** np.ceil(ends[1]))
        axis.set_xticks(where, list(stages), fontsize="small")
        axis.set_title(f"variance, {label}")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def palm_paths(variants: Mapping[str, Sequence[Mapping[str, Any]]]) -> Figure:
    """Fig 8: paths of the palms up to the lift, seen from above; variants beside each other."""
    figure, axes = plt.subplots(
        1,
        len(variants),
        figsize=(1.0 + 4.0 * len(variants), 4.5),
        sharex=True,
        sharey=True,
        squeeze=False,
        layout="constrained",
    )
    for axis, (variant, rows) in zip(axes[0], variants.items(), strict=True):
        _box(axis)
        for row in rows:
            t = np.array(row["paths"]["t"])[:, 0]
            mine = (t >= row["moments"][0]) & (t <= row["moments"][-1])
            for name, colour in zip(PALMS, (DRAWN, MEANT), strict=True):
                path = np.array(row["paths"][name])[mine]
                axis.plot(-path[:, 1], path[:, 0], color=colour, lw=1)
        _square(axis, f"{variant} palm paths, {len(rows)} trials".strip())
    return figure


def _box(axis: Axes) -> None:
    axis.add_patch(Rectangle((-BOX[1] / 2, -BOX[0] / 2), BOX[1], BOX[0], fill=False))


def _square(axis: Axes, title: str) -> None:
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set_title(title)
    axis.set_xlabel("[m]")
    axis.set_ylabel("[m]")
