"""Picture of the floor from above: what stands and walks there, and the platform's way past it."""

from __future__ import annotations

import math
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from deploy.robot import Equipped, load_robot
from services.logs.runlog import RunLog
from services.reports.curves import HOLE, known
from services.reports.floor_things import (
    HALO,
    Way,
    board_ends,
    corners,
    has_table,
    nearest,
    obstacles,
    seen,
    walkers,
)
from services.topics import ESTIMATE, TRUTH
from sim.obstacle_specs import Mover, Pillar
from sim.scenario import Scenario

Array = NDArray[np.float64]

START, GOAL = "#1b7f3b", "#1f4e9c"
# the bright end of the map would be lost on white
SPEED = LinearSegmentedColormap.from_list("speed", plt.get_cmap("plasma")(np.linspace(0, 0.85, 64)))
MOVED = 0.05
"""A platform that stays within this has not moved [m]."""
DIFFERS = 0.02
"""An estimate nearer than this to the truth would lie on its line [m]."""
AROUND = 4.0
"""Obstacles farther than this from the way are not worth making the picture larger for [m]."""
BOARD_NEAR = 2.0
"""A board farther than this from the way plays no part [m]."""
MOST = 7
"""Outlines of the platform at most: more would hide each other."""
SLOW = 0.02
"""A platform slower than this stands [m/s]."""
APART = 1.5
"""Between the middles of two outlines at least, in radii of the platform."""
SIDE, COLUMN, MARGIN = 8.0, 3.6, 0.8  # of the longer side, the legend, the labels [inch]


def floor(log: RunLog, title: str, scenario: Scenario) -> Figure | None:
    """Plan view in W; None where the platform stood on an empty floor.

    Args:
        log: of a run.
        title: of the picture.
        scenario: that was run, for its obstacles, board, goal and robot.
    """
    truth = log.series(TRUTH)
    if len(truth) < 2:
        return None
    way = Way(*(np.array([getattr(x, k) for x in truth]) for k in ("t", "pose", "velocity")))
    if np.hypot(*np.ptp(way.pose[:, :2], axis=0)) < MOVED and not scenario.world.obstacle:
        return None
    robot = load_robot(scenario.robot, Equipped)
    low, high = _view(way, scenario, robot.chassis.radius)
    size = (high - low) * SIDE / float((high - low).max())
    # everything beside the plan in inches, so that the legend never lies on it
    width, height = size[0] + 2 * MARGIN + COLUMN, max(size[1], 4.0) + 2 * MARGIN
    figure = plt.figure(figsize=(width, height))

    def place(x: float, wide: float, tall: float) -> Any:
        return figure.add_axes(
            (x / width, (height - MARGIN - tall) / height, wide / width, tall / height)
        )

    axis = place(MARGIN, size[0], size[1])
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    _ticks(axis, float((high - low).max()))
    axis.set(xlabel="x of W [m]", ylabel="y of W [m]")
    axis.set_axisbelow(True)
    obstacles(axis, scenario)
    seen(axis, log, way, scenario.sensors.overlay(robot))
    _estimated(axis, log, way)
    lines = _driven(axis, way)
    radius = robot.chassis.radius
    taken = nearest(axis, way, scenario, radius)
    _outlines(axis, way, radius, [*taken, way.pose[0, :2], way.pose[-1, :2]], scenario)
    _ends(axis, way, scenario, radius)
    beside = MARGIN + size[0] + 0.2
    bar = figure.colorbar(lines, cax=place(beside, 0.15, min(size[1], 2.5)))
    bar.set_label("speed along the way [m/s]")
    figure.legend(
        *_once(axis),
        loc="upper left",
        bbox_to_anchor=((beside + 0.85) / width, (height - MARGIN) / height),
        borderaxespad=0.0,
        frameon=False,
        fontsize=9,
        labelspacing=0.9,
    )
    figure.text(
        MARGIN / width, 1.0 - 0.35 / height, f"{title}: the floor from above", size=12, va="center"
    )
    return figure


def _view(way: Way, scenario: Scenario, radius: float) -> tuple[Array, Array]:
    """Lower left and upper right of what is shown, (2,) each [m]."""
    base, board = scenario.task.base, scenario.world.board
    places = [way.pose[:, :2]]
    places += [np.array([pose[:2]]) for pose in (base.goal, base.object) if pose is not None]
    own = np.concatenate(places)
    low, high = own.min(axis=0) - 1.3 * radius, own.max(axis=0) + 1.3 * radius
    place, around = np.array([board.x, board.y]), []
    if has_table(scenario):  # and no board
        table = scenario.world.table
        half = 0.5 * math.hypot(*table.size)
        around.append(np.array([table.x, table.y]) + half * np.array([[-1, -1], [1, 1]]))
    elif (place > low - BOARD_NEAR).all() and (place < high + BOARD_NEAR).all():
        around.append(board_ends(scenario))
    for spec in scenario.world.obstacle:
        if isinstance(spec, Mover):
            around += [np.array(spec.points) + side * spec.radius for side in (-1, 1)]
        elif isinstance(spec, Pillar):
            around.append(np.array([spec.x, spec.y]) + spec.radius * np.array([[-1, -1], [1, 1]]))
        else:
            around.append(corners(spec))
    if around:
        points = np.concatenate(around).clip(low - AROUND, high + AROUND)
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    # a narrow strip would be hard to read
    half = np.maximum(0.5 * (high - low), 0.25 * float((high - low).max())) + 0.1
    middle = 0.5 * (low + high)
    return middle - half, middle + half


def _ticks(axis: Any, largest: float) -> None:
    """A square of the grid is one metre where that can be read."""
    step = next(s for s in (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0, 1e9) if largest / s <= 9)
    axis.xaxis.set_major_locator(plt.MultipleLocator(step))
    axis.yaxis.set_major_locator(plt.MultipleLocator(step))
    axis.set_title(f"a square of the grid is {step:g} m wide", fontsize=9, loc="left", color="0.35")


def _estimated(axis: Any, log: RunLog, way: Way) -> None:
    said = [e for e in log.series(ESTIMATE)[::5] if e.valid]
    there = known(np.array([e.t for e in said]), way.t)
    kept = [e for e, k in zip(said, there, strict=True) if k]
    if not kept:
        return
    pose = np.array([e.pose[:2] for e in kept])
    off = np.hypot(*(pose - way.at(np.array([e.t for e in kept]))[:, :2]).T) > DIFFERS
    if off.any():
        shown = np.where(off[:, None], pose, np.nan)
        label = f"way as estimated,\nwhere off by more than {1e3 * DIFFERS:g} mm"
        axis.plot(*shown.T, color="black", lw=1.0, zorder=4, label=label)


def _driven(axis: Any, way: Way) -> LineCollection:
    speed = np.hypot(*way.velocity[:, :2].T)
    points, whole = way.pose[::4, :2], np.diff(way.t[::4]) <= HOLE
    pieces = list(np.stack([points[:-1], points[1:]], axis=1)[whole])
    lines = LineCollection(pieces, cmap=SPEED, array=speed[::4][:-1][whole], lw=3.5, zorder=3)
    lines.set_clim(0.0, max(float(np.percentile(speed, 99.5)), 0.01))
    lines.set_capstyle("round")
    axis.add_collection(lines)
    axis.plot([], [], color=SPEED(0.8), lw=3.5, label="way of the platform's middle")
    return lines


def _outline(axis: Any, pose: Array, radius: float, colour: str, **style: Any) -> None:
    """The platform's edge, and its heading as a tick from half-way out to a bit beyond it."""
    style = {"lw": 1.0, "ls": "-", "fill": False, "zorder": 3.5, **style}
    axis.add_patch(Circle((pose[0], pose[1]), radius, edgecolor=colour, **style))
    tick = pose[:2] + np.outer([0.6, 1.12], radius * np.array([np.cos(pose[2]), np.sin(pose[2])]))
    axis.plot(*tick.T, color=colour, lw=style["lw"] + 0.8, zorder=style["zorder"])


def _outlines(axis: Any, way: Way, radius: float, taken: list[Array], scenario: Scenario) -> None:
    """Outlines at round times where there is room, each with its time beside the way.

    Args:
        axis: to draw on.
        way: of the platform.
        radius: of the platform [m].
        taken: places (2,) that other circles have [m].
        scenario: for its walkers, who are marked at the same times.
    """
    speed = np.hypot(*way.velocity[:, :2].T)
    usual = float(np.median(speed[speed > SLOW])) if (speed > SLOW).any() else SLOW
    for step in (1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 300.0, 3600.0):
        shown, middles = [], list(taken)
        times = np.arange(step, way.t[-1], step)
        for t in times[known(times, way.t)]:
            middle = way.at(t)[0, :2]
            if min(np.hypot(*(middle - other)) for other in middles) > APART * radius:
                middles.append(middle)
                shown.append(float(t))
        if len(shown) <= MOST and step * usual > APART * radius:
            break
    for t in shown:
        pose, later = way.at(np.array([t, t + 0.2]))
        _outline(axis, pose, radius, "0.35")
        _time(axis, pose, later[:2] - pose[:2], radius, t)
    if shown:
        label = f"platform every {step:g} s,\nwhere there is room"
        axis.plot([], [], "o", mfc="none", mec="0.35", ms=12, label=label)
        walkers(axis, scenario, np.arange(step, way.t[-1], step))


def _time(axis: Any, pose: Array, along: Array, radius: float, t: float) -> None:
    """The time beside the way, on the side where the heading's tick is not."""
    beside = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
    if beside @ [np.cos(pose[2]), np.sin(pose[2])] > 0.0:
        beside = -beside
    at = pose[:2] + 0.55 * radius * beside
    axis.text(*at, f"{t:g} s", fontsize=8, ha="center", va="center", path_effects=HALO, zorder=5)


def _ends(axis: Any, way: Way, scenario: Scenario, radius: float) -> None:
    base = scenario.task.base
    _outline(axis, way.pose[0], radius, START, lw=2.0)
    axis.plot([], [], "o", mfc="none", mec=START, mew=2, ms=12, label="start (tick: heading)")
    if base.goal is not None:
        goal = np.array(base.goal)
        _outline(axis, goal, radius, GOAL, lw=1.6, fill=True, facecolor=f"{GOAL}22", zorder=2.2)
        axis.plot(*goal[:2], "x", color=GOAL, ms=9, mew=2, zorder=4.5)
        axis.plot([], [], "X", color=GOAL, ms=9, mew=0, label="goal, and the platform there")
    if base.object is not None:
        x, y, yaw = base.object
        tip = 0.35 * np.array([math.cos(yaw), math.sin(yaw)])
        axis.annotate("", (x + tip[0], y + tip[1]), (x, y), arrowprops={"color": GOAL, "width": 2})
        axis.plot(x, y, "D", color=GOAL, ms=8, zorder=4.5, label="object, arrow out of its front")
    _outline(axis, way.pose[-1], radius, "black", lw=1.6)
    for pose, colour in ((way.pose[0], START), (way.pose[-1], "black")):  # on the way itself
        axis.plot(*pose[:2], "o", color=colour, ms=7, mec="white", mew=1.2, zorder=4.6)
    label = f"end, after {way.t[-1]:.3g} s"
    axis.plot([], [], "o", mfc="none", mec="black", mew=1.6, ms=12, label=label)


def _once(axis: Any) -> tuple[list[Any], list[str]]:
    """Handles and labels, every label once."""
    handles, labels = axis.get_legend_handles_labels()
    kept = dict(zip(labels, handles, strict=True))
    return list(kept.values()), list(kept)
