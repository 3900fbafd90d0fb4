"""What a picture of the floor shows around the platform: obstacles, walkers, laser, nearness."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import matplotlib.patheffects as effects
import numpy as np
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from deploy.robot import Equipped
from services.logs.runlog import RunLog
from services.reports.curves import hermite
from services.topics import SCAN
from sim.obstacle_specs import Box, Mover, Pillar, Wall
from sim.obstacles import Obstacles
from sim.scenario import Scenario

Array = NDArray[np.float64]

STANDS, WALKS, SEEN, NEAR = "0.72", "#d9480f", "#0b7285", "#c2255c"
HALO = (effects.withStroke(linewidth=2.5, foreground="white"),)
"""So that writing can be read on anything."""


@dataclass(frozen=True)
class Way:
    """Where the platform truly was.

    Attributes:
        t: shape (n,) [s].
        pose: X_WB, shape (n, 3) [m, m, rad].
        velocity: V_WB_W, shape (n, 3) [m/s, m/s, rad/s].
    """

    t: Array
    pose: Array
    velocity: Array

    def at(self, t: float | Array) -> Array:
        """X_WB at times (k,) [s], shape (k, 3)."""
        return hermite(np.atleast_1d(np.asarray(t, float)), self.t, self.pose, self.velocity)


def corners(spec: Box | Wall) -> Array:
    """Corners of a box in W, (4, 2) [m]."""
    box = spec.box() if isinstance(spec, Wall) else spec
    c, s = math.cos(box.yaw), math.sin(box.yaw)
    own = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [box.length, box.width]
    return np.array([box.x, box.y]) + own @ np.array([[c, s], [-s, c]])


def board_ends(scenario: Scenario) -> Array:
    """Ends of the board in W, (2, 2) [m]."""
    board = scenario.world.board
    return board.position()[:2] + 0.5 * board.width * np.outer([-1, 1], board.rotation()[:2, 0])


def obstacles(axis: Any, scenario: Scenario) -> None:
    """Draw what stands, the walkers' tracks, and the board where it is in view."""
    style: dict[str, Any] = {"facecolor": STANDS, "edgecolor": "0.3", "lw": 0.8, "zorder": 1.5}
    for spec in scenario.world.obstacle:
        if isinstance(spec, Mover):
            points = np.array(spec.points + (spec.points[:1] if spec.loop else ()))
            axis.plot(*points.T, color=WALKS, lw=1.5, ls="--", zorder=2, label="walker's track")
            tip = {"arrowstyle": "-|>", "color": WALKS, "mutation_scale": 18, "shrinkB": 0}
            axis.annotate("", points[-1], 0.1 * points[-2] + 0.9 * points[-1], arrowprops=tip)
        elif isinstance(spec, Pillar):
            axis.add_patch(Circle((spec.x, spec.y), spec.radius, **style))
        else:
            axis.add_patch(Polygon(corners(spec), **style))
    if any(not isinstance(spec, Mover) for spec in scenario.world.obstacle):
        axis.plot([], [], "s", color=STANDS, mec="0.3", ms=10, label="obstacle")
    if has_table(scenario):  # and no board
        _table(axis, scenario)
        return
    ends = board_ends(scenario)
    low, high = np.array([axis.get_xlim(), axis.get_ylim()]).T
    if ((ends > low) & (ends < high)).all():
        axis.plot(*ends.T, color="black", lw=4, solid_capstyle="butt", zorder=2.5, label="board")


def has_table(scenario: Scenario) -> bool:
    """Whether there is a table, with something to grasp on it."""
    return scenario.world.box is not None or scenario.world.bottle is not None


def _table(axis: Any, scenario: Scenario) -> None:
    """Draw the table's top and what stood on it."""
    table, box, bottle = scenario.world.table, scenario.world.box, scenario.world.bottle
    things: list[tuple[Any, float, float, str, str]] = [(table, *table.size, "0.92", "table")]
    if box is not None:
        things.append((box, box.size[0], box.size[1], STANDS, "box, as it stood"))
    for spec, depth, width, colour, label in things:
        c, s = math.cos(spec.yaw), math.sin(spec.yaw)
        own = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [depth, width]
        points = np.array([spec.x, spec.y]) + own @ np.array([[c, s], [-s, c]])
        axis.add_patch(Polygon(points, facecolor=colour, edgecolor="0.3", lw=0.8, zorder=1.2))
        axis.plot([], [], "s", color=colour, mec="0.3", ms=10, label=label)
    if bottle is not None:
        axis.plot(bottle.x, bottle.y, "o", color=STANDS, mec="0.3", label="bottle, as it stood")
    if scenario.task.bottle is not None:
        axis.plot(*scenario.task.bottle.goal, "o", mfc="none", mec="0.3", label="where it is to go")


def seen(axis: Any, log: RunLog, way: Way, robot: Equipped) -> None:
    """Draw where the laser's beams ended, from where the platform truly was."""
    if robot.laser is None:
        return
    found = []
    for scan in log.series(SCAN)[::2]:
        x, y, heading = way.at(scan.t)[0]
        hit = (scan.ranges > 0.0) & (scan.ranges < scan.farthest)
        bearing = heading + scan.start + scan.increment * np.flatnonzero(hit)
        c, s = math.cos(heading), math.sin(heading)
        a, b = robot.laser.position
        ray = scan.ranges[hit, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])
        found.append(np.array([x + c * a - s * b, y + s * a + c * b]) + ray)
    points = np.concatenate(found) if found else np.zeros((0, 2))
    if len(points):
        axis.plot(*points.T, ".", color=SEEN, ms=1.8, mew=0, alpha=0.35, zorder=1.8)
        axis.plot([], [], ".", color=SEEN, ms=9, mew=0, label="seen by the laser")


def walkers(axis: Any, scenario: Scenario, times: Array) -> None:
    """Mark where each walker is at some times (n,) [s], as long as it walks."""
    for spec in scenario.world.obstacle:
        if not isinstance(spec, Mover):
            continue
        label, around = "the walker then", Obstacles([spec])
        for t in times:
            x, y, _ = around.at(t).circles[0]
            if not around.velocities(t).any():
                continue
            axis.plot(x, y, "o", color=WALKS, ms=5, zorder=4.5, label=label)
            axis.annotate(
                f"{t:g} s", (x, y), (6, 0), textcoords="offset points", color=WALKS, fontsize=8,
                va="center", path_effects=HALO, zorder=5,
            )  # fmt: skip


def nearest(axis: Any, way: Way, scenario: Scenario, radius: float) -> list[Array]:
    """Mark where the platform comes nearest to what stands, and to each walker.

    Returns:
        Middles (2,) of the circles drawn for it [m].
    """
    specs = scenario.world.obstacle
    standing = [spec for spec in specs if not isinstance(spec, Mover)]
    groups: list[list[Any]] = [standing] if standing else []
    groups += [[spec] for spec in specs if isinstance(spec, Mover)]
    taken: list[Array] = []
    for group in groups:
        around = Obstacles(group)
        each = zip(way.t[::4], way.pose[::4], strict=True)
        gaps = [around.clearance(t, pose, radius) for t, pose in each]
        i = 4 * int(np.argmin(gaps))
        t, pose = float(way.t[i]), way.pose[i]
        distance, toward = around.at(t).nearest(pose[:2])
        k = int(np.argmin(distance))
        touch = pose[:2] + toward[k] * distance[k]
        walks = isinstance(group[0], Mover)
        colour, name = (WALKS, "the walker") if walks else (NEAR, "an obstacle")
        edge = {"fill": False, "edgecolor": colour, "lw": 1.4, "ls": "--"}
        axis.add_patch(Circle(pose[:2], radius, zorder=3.6, **edge))
        label = f"nearest to {name}\n(platform dashed): {1e3 * min(gaps):.0f} mm, {t:.1f} s"
        taken.append(pose[:2])
        if walks:
            x, y, size = around.at(t).circles[0]
            axis.add_patch(Circle((x, y), size, fc=f"{WALKS}55", ec=WALKS, zorder=2.8))
            axis.plot([], [], "o", color=f"{WALKS}55", mec=WALKS, ms=12, label=label)
            taken.append(np.array([x, y]))
        else:
            axis.plot(*touch, "*", color=NEAR, ms=10, mec="white", mew=0.6, zorder=6, label=label)
    return taken
