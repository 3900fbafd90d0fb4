"""The picture of a run in which a hand fetches a bottle: its way, and what happened meanwhile."""

from __future__ import annotations

import math

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.transforms import Affine2D

from arm.hand.sliding import Way
from services.logs.runlog import RunLog
from services.reports.bottle import CARRIED, NEAR, Bottled, bottled
from services.topics import ARM_STATUS
from sim.scenario import Scenario

BOTTLE, PALM, PLATFORM = "#1b7f3b", "#1f4e9c", "#e08a1e"
FINGERS = ("#1f4e9c", "#e08a1e", "#0b7285")
LIMIT = 80.0
"""Force that a fingertip is stated to stand [N]."""


def bottle(log: RunLog, title: str, scenario: Scenario | None = None) -> Figure | None:
    """Way from above; residuals, forces, tilt and slip, and the hand in the world, over time."""
    seen = bottled(log)
    if seen is None:
        return None
    figure = plt.figure(figsize=(14, 9), layout="constrained")
    grid = figure.add_gridspec(5, 2, width_ratios=(1, 1.5), height_ratios=(1.3, 1, 1, 1, 1))
    above = figure.add_subplot(grid[:3, 0])
    still = figure.add_subplot(grid[3:, 0])
    axes = [figure.add_subplot(grid[0, 1])]
    axes += [figure.add_subplot(grid[i, 1], sharex=axes[0]) for i in range(1, 5)]
    _above(above, seen, scenario)
    _still(still, seen)
    height, residuals, force, tilt, slip = axes
    height.plot(seen.t, 1e3 * (seen.foot[:, 2] - seen.foot[0, 2]), color=BOTTLE)
    height.set(ylabel="bottle\nup by [mm]")
    _nodes(height, seen)
    _residuals(residuals, log)
    for i in range(3):
        force.plot(seen.t, seen.force[:, i], color=FINGERS[i], lw=0.9, label=f"finger {i}")
    force.axhline(LIMIT, color="#b3261e", ls=":", lw=1.0, label="stated limit")
    force.set(ylabel="force on\na tip [N]", yscale="symlog")
    force.set_yticks([0, 1, 10, 40, 80], ["0", "1", "10", "40", "80"])
    force.legend(fontsize=7, loc="upper left")
    tilt.plot(seen.t, np.degrees(seen.tilt), color=BOTTLE)
    tilt.set(ylabel="bottle's\ntilt [deg]", ylim=(0.0, None))
    carried = seen.during(*CARRIED)
    if carried.any():
        moved = np.linalg.norm(seen.held - seen.held[carried][0], axis=1)
        slip.plot(seen.t, 1e3 * np.where(carried, moved, math.nan), color=BOTTLE)
    slip.set(ylabel="moved in the\nhand [mm]", ylim=(0.0, None), xlabel="t [s]")
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    near = seen.during("Hand_reach")
    since = float(seen.t[int(np.argmax(near))]) if near.any() else 0.0
    slip.set_xlim(since, float(seen.t[-1]))
    figure.suptitle(title)
    return figure


def _above(axis: plt.Axes, seen: Bottled, scenario: Scenario | None) -> None:
    axis.plot(*seen.pose[:, :2].T, color=PLATFORM, lw=1.2, label="platform's middle")
    axis.plot(*seen.palm[:, :2].T, color=PALM, lw=1.0, label="palm")
    axis.plot(*seen.foot[:, :2].T, color=BOTTLE, lw=2.0, label="bottle")
    if scenario is not None and scenario.task.bottle is not None:
        table = scenario.world.table
        x, y = table.size
        turn = Affine2D().rotate(table.yaw).translate(table.x, table.y) + axis.transData
        axis.add_patch(
            Rectangle((-x / 2, -y / 2), x, y, transform=turn, fc="0.93", ec="0.6", zorder=0)
        )
        axis.add_patch(Circle(scenario.task.bottle.goal, NEAR, fc="none", ec="#b3261e"))
        axis.plot([], [], "o", mfc="none", mec="#b3261e", label="goal")
    axis.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axis.legend(fontsize=8, loc="upper left")


def _still(axis: plt.Axes, seen: Bottled) -> None:
    """Hand and platform in the world while the platform goes to and fro."""
    mask = seen.during("Hand_stay")
    if mask.sum() < 3:
        axis.axis("off")
        return
    t = seen.t[mask]
    for name, way, colour in (("platform", seen.pose, PLATFORM), ("palm", seen.palm, PALM)):
        off = 1e3 * np.hypot(*(way[mask, :2] - way[mask, :2].mean(axis=0)).T)
        axis.plot(t, np.maximum(off, 1e-3), color=colour, lw=1.0, label=name)
    axis.set(yscale="log", ylabel="from its mean place [mm]", xlabel="t [s]")
    axis.set_title("In the world, while the platform goes to and fro", fontsize=9)
    axis.legend(fontsize=8)


def _nodes(axis: plt.Axes, seen: Bottled) -> None:
    before, free = "", -math.inf
    late = float(seen.t[-1]) - 1.5  # what begins there has no room to its right [s]
    low, high = axis.get_ylim()
    axis.set_ylim(low, high + 0.9 * (high - low))
    for t, node in zip(seen.t, seen.node, strict=True):
        if node and node != before:
            axis.axvline(t, color="0.8", lw=0.6)
            if t - free > 0.4:
                side = "right" if t > late else "left"
                axis.text(
                    t, high, node, fontsize=7, rotation=50, va="bottom", ha=side, clip_on=True
                )
                free = t
        before = node


def _residuals(axis: plt.Axes, log: RunLog) -> None:
    slid = [(s.t, *s.residuals) for s in log.series(ARM_STATUS) if len(s.residuals) == 2]
    if slid:
        t, rho, moment = np.array(slid).T
        gap = np.diff(t, prepend=t[0]) > 0.2  # another try
        for name, values, colour in (("force", rho, PALM), ("moment", moment, PLATFORM)):
            axis.plot(t, np.where(gap, math.nan, values), color=colour, lw=1.2, label=name)
    axis.axhline(Way().small, color="0.4", ls="--", lw=0.8, label="converged below")
    axis.set(ylabel="residuals", ylim=(0.0, None))
    axis.legend(fontsize=7)
