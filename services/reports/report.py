"""Pictures of a run: the board, the estimate, the force, the torques, the floor."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from deploy.task import BoardPose
from services.logs.runlog import RunLog
from services.messages import ArmStatus, BoardEstimate
from services.reports.bottle import bottled
from services.reports.bottle_picture import bottle
from services.reports.curves import broken, distance_to_path, hermite, known
from services.reports.evaluation import Stroke, arm_worked, strokes_of
from services.reports.floor_picture import floor
from services.reports.grasp import grasp, palmed
from services.reports.sharing_picture import sharing
from services.topics import ARM_COMMAND, ARM_STATUS, BOARD, ESTIMATE, TRUTH
from sim.scenario import Scenario

Array = NDArray[np.float64]

Draw = Callable[[RunLog, str], Figure | None]

DRAWN, MEANT, ERROR, AT_BOARD = "#1f4e9c", "#e08a1e", "#b3261e", "#1b7f3b"
STRETCHES, FINEST = 1200, 0.02
"""A spread is shown over so many stretches of a run, each at least so long [s]."""
TAIL = 0.01
"""Share of the samples beyond a spread, on either side."""
NAMED = "#a35f00"
"""Colour of nodes' names: that of their marks, dark enough to read."""
NAME_WIDTH = 0.0075
"""Of a letter of a node's name, over the width of the picture."""
plt.rcParams.update(
    {
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.alpha": 0.3,
        "font.size": 10,
        "figure.dpi": 110,
    }
)


def write_pictures(
    log: RunLog, folder: Path, title: str, scenario: Scenario | None = None
) -> list[Path]:
    """Draw every picture the run has data for; returns the files.

    Args:
        log: of a run.
        folder: where to.
        title: of each picture.
        scenario: that was run; without it there is no picture of the floor.
    """
    drawn = figures_for(log, scenario).items()
    return save(folder, ((name, draw(log, title)) for name, draw in drawn))


def figures_for(log: RunLog, scenario: Scenario | None = None) -> dict[str, Draw]:
    """The pictures that a run may have, by name; each gives None where it has no data for it."""
    out: dict[str, Draw] = {
        "estimate": lambda log, title: estimate(log, title, scenario),
        "torques": torques,
    }
    if bottled(log) is not None:
        out = {"grasp": lambda log, title: bottle(log, title, scenario), **out}
    elif palmed(log) is not None:  # no pen, no board
        out = {"grasp": grasp, **out}
    else:
        out = {"board": board, "drawing": drawing, **out, "force": force, "sharing": sharing}
    if scenario is not None:
        out["floor"] = lambda log, title: floor(log, title, scenario)
    return out


def save(folder: Path, figures: Iterable[tuple[str, Figure | None]]) -> list[Path]:
    """Write figures as ``<name>.png``, closing each before the next is drawn; returns the files."""
    out = []
    for name, figure in figures:
        if figure is None:
            continue
        path = folder / f"{name}.png"
        figure.savefig(path, metadata={"Software": None})
        plt.close(figure)
        out.append(path)
    return out


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
    _once(left)
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


def estimate(log: RunLog, title: str, scenario: Scenario | None = None) -> Figure | None:
    """Platform truth against estimate, and their difference; nothing where nothing is known.

    Args:
        log: of a run.
        title: of the picture.
        scenario: that was run, for its board: where a camera watches it, the difference is also
            shown as seen from there.
    """
    truth, estimates = log.series(TRUTH), log.series(ESTIMATE)
    if len(truth) < 2 or len(estimates) < 2:
        return None
    t = np.array([x.t for x in truth])
    pose = np.array([x.pose for x in truth])
    te = np.array([e.t for e in estimates])
    valid = np.array([e.valid for e in estimates])[:, None]
    believed = np.where(valid, np.array([e.pose for e in estimates]), np.nan)
    sigma = np.where(valid, np.sqrt([e.covariance.diagonal()[:3] for e in estimates]), np.nan)
    true = hermite(te, t, pose, np.array([x.velocity for x in truth]))
    true = np.where(known(te, t)[:, None], true, np.nan)
    lines = [("error", ERROR, believed - true)]
    if scenario is not None and (boards := log.series(BOARD)):
        seen = _from_board(te, believed, boards, scenario.world.board)
        lines.append(("error, the board where it is seen", AT_BOARD, seen - true))
    t, pose = broken(t, pose)
    at, believed, sigma = broken(te, believed, sigma)
    figure, axes = plt.subplots(3, 2, figsize=(13, 8), sharex=True, layout="constrained")
    names = (("x", 1e3, "mm"), ("y", 1e3, "mm"), ("heading", 180 / np.pi, "deg"))
    for i, (name, scale, unit) in enumerate(names):
        value, difference = axes[i]
        value.plot(t, scale * pose[:, i], color=MEANT, lw=4, alpha=0.5, label="truth")
        value.plot(at, scale * believed[:, i], color=DRAWN, lw=1, label="estimate, where valid")
        value.set_ylabel(f"{name} [{unit}]")
        band = 3 * scale * sigma[:, i]
        difference.fill_between(at, -band, band, color="0.85", lw=0, label="3 sigma, as reported")
        for label, colour, error in lines:
            moment, shown = broken(te, scale * error[:, i])
            difference.plot(moment, shown, color=colour, lw=0.8, label=label)
        difference.set_ylabel(f"error of {name} [{unit}]")
        errors = np.abs(np.concatenate([scale * error[:, i] for _, _, error in lines]))
        reach = np.nanmax(errors) if np.isfinite(errors).any() else 1.0
        difference.set_ylim(*(1.3 * max(reach, 1e-3) * np.array([-1, 1])))
    for axis in axes[0]:  # above, where it hides nothing
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
    for axis in axes[2]:
        axis.set_xlabel("t [s]")
    figure.suptitle(title)
    return figure


def _from_board(t: Array, believed: Array, boards: list[BoardEstimate], board: BoardPose) -> Array:
    """Where a pose that is believed lies if the board is where it truly is, not where it drifted.

    Args:
        t: instants, shape (n,) [s].
        believed: X_OB then, shape (n, 3) [m, m, rad].
        boards: X_OS as estimated over time.
        board: X_WS.

    Returns:
        X_WB, shape (n, 3) [m, m, rad].
    """
    ts = np.array([b.t for b in boards])
    x, y, yaw = (np.interp(t, ts, column) for column in np.array([b.pose for b in boards]).T)
    turned = board.yaw - yaw
    c, s = np.cos(turned), np.sin(turned)
    dx, dy = believed[:, 0] - x, believed[:, 1] - y
    place = [board.x + c * dx - s * dy, board.y + s * dx + c * dy, believed[:, 2] + turned]
    seen = np.column_stack(place)
    seen[~known(t, ts)] = np.nan
    return seen


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
    at, low, high = _spread(t, recent)
    wide = 1e3 * (at[1] - at[0]) if len(at) > 1 else 1.0
    label = f"all but {100 * (2 * TAIL):g} % of the samples in {wide:.2g} ms"
    axis.fill_between(*broken(at, low, high), color="0.75", lw=0, label=label)
    axis.plot(moment, smooth, color=DRAWN, lw=0.9, label="mean over 20 ms")
    axis.set(xlabel="t [s]", ylabel="force on the board [N]")
    top = float(np.nanpercentile(smooth, 99.9)) * 1.6
    axis.set_ylim(-0.1, max(top, 1.0))
    _once(axis)
    figure.suptitle(title)
    return figure


def _spread(t: Array, values: Array) -> tuple[Array, Array, Array]:
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


def torques(log: RunLog, title: str) -> Figure | None:
    """Joint torques over time; nodes are named above where there is room, their changes marked."""
    commands, statuses = log.series(ARM_COMMAND), log.series(ARM_STATUS)
    if not commands:
        return None
    t, tau = broken(np.array([c.t for c in commands]), np.array([c.tau for c in commands]))
    joints = tau.shape[1]
    size = (13, max(10.0, 1.2 * joints))
    figure, axes = plt.subplots(joints, 1, figsize=size, sharex=True, layout="constrained")
    changes = [b for a, b in itertools.pairwise(statuses) if a.node != b.node]
    for i, axis in enumerate(axes):
        axis.plot(t, tau[:, i], color=DRAWN, lw=0.7)
        axis.set_ylabel(f"joint {i + 1}\n[N m]")
        for change in changes:
            axis.axvline(change.t, color=MEANT, lw=0.8, alpha=0.7)
    axes[0].set_xlim(t[0], t[-1])
    figure.align_ylabels()
    _name_nodes(axes[0], [*statuses[:1], *changes], t[-1])
    axes[-1].set_xlabel("t [s] (lines: changes of node; its name is above where there is room)")
    figure.suptitle(title)
    return figure


def _name_nodes(axis: Any, starts: list[ArmStatus], end: float) -> None:
    """Write nodes' names above an axis, each over its own stretch, level or upright if it fits."""
    low, high = axis.get_xlim()
    ends = [*(s.t for s in starts[1:]), end]
    for start, until in zip(starts, ends, strict=True):
        room = (until - start.t) / (high - low)
        level = room > NAME_WIDTH * len(start.node)
        if start.node and (level or room > 2.0 * NAME_WIDTH):
            axis.text(
                0.5 * (start.t + until), 1.03, start.node, transform=axis.get_xaxis_transform(),
                rotation=0 if level else 90, ha="center", va="bottom", fontsize=8, color=NAMED,
            )  # fmt: skip


def _once(axis: Any) -> None:
    """A legend that names every label once."""
    handles, labels = axis.get_legend_handles_labels()
    axis.legend(
        *zip(
            *dict(zip(labels, zip(handles, labels, strict=True), strict=True)).values(), strict=True
        )
    )
