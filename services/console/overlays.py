"""Marks in the scene: covariance ellipse, trail, laser, votes, ink, palm forces, the goal."""

from __future__ import annotations

import colorsys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from services.console.feed import Feed, moved
from services.console.robot_view import BLUE, GREEN, upright
from services.console.surroundings import Surroundings
from services.messages import BaseStatus, Estimate, Scan, Truth
from services.topics import BASE_STATUS, ESTIMATE, SCAN, TRUTH

Array = NDArray[np.float64]

CIRCLE = np.linspace(0.0, 2 * np.pi, 49)
FLOOR = 0.01  # height of marks on the floor [m]
RED, INK, GOLD = (214, 40, 40), (20, 30, 120), (220, 160, 20)
SECONDS = 2.0
"""An arrow of a vote is the way driven at that velocity in this time [s]."""
PER_NEWTON = 0.01  # [m/N]
NOWHERE = np.zeros((1, 2, 3))


class Overlays:
    """All marks, each shown when there is something to show.

    Args:
        scene: of viser.
        surroundings: for the board.
        laser: p_BL of the laser (x, y) [m], None without one.
    """

    def __init__(
        self, scene: Any, surroundings: Surroundings, laser: tuple[float, float] | None
    ) -> None:
        self._scene, self._laser = scene, laser
        self._board = surroundings.board is not None
        self._ellipse = self._lines("/marks/ellipse", BLUE, 3)
        self._trail = self._lines("/marks/trail", GREEN, 2)
        self._scan = scene.add_point_cloud(
            "/marks/laser",
            points=np.zeros((1, 3)),
            colors=RED,
            point_size=0.035,
            point_shape="circle",
            point_shading="flat",
            visible=False,
        )
        self._votes = self._arrows("/marks/votes", 0.012)
        self._forces = self._arrows("/marks/forces", 0.008)
        self._goal = scene.add_frame(
            "/marks/goal", axes_length=0.4, axes_radius=0.015, origin_color=GOLD, visible=False
        )
        self._ink: list[tuple[int, Any]] = []
        self._trail_points = 0
        self._scanned = -1.0

    def _lines(self, name: str, colour: tuple[int, int, int], width: float) -> Any:
        return self._scene.add_line_segments(
            name,
            points=NOWHERE,
            colors=colour,
            thickness=width,
            thickness_units="screen",
            visible=False,
        )

    def _arrows(self, name: str, radius: float) -> Any:
        return self._scene.add_arrows(
            name,
            points=NOWHERE,
            colors=np.zeros((1, 3), np.uint8),
            shaft_radius=radius,
            head_radius=2.5 * radius,
            head_length=6 * radius,
            visible=False,
        )

    def show(self, feed: Feed, where: Array, magnify: float) -> None:
        """Bring all marks up to date.

        Args:
            feed: what was heard.
            where: X_WB at which the robot is drawn.
            magnify: how many times larger than it is the uncertainty is drawn.
        """
        estimate, truth = feed.latest(ESTIMATE), feed.latest(TRUTH)
        self._show_ellipse(estimate, where, magnify)
        self._show_trail(feed)
        self._show_scan(feed.latest(SCAN), estimate, feed.offset)
        self._show_votes(feed.latest(BASE_STATUS), where)
        self._show_forces(truth)
        if self._board:
            self._show_ink(feed)

    def show_goal(self, pose: Array | None) -> None:
        """Mark a goal of the platform: x, y, heading in the world's frame."""
        self._goal.visible = pose is not None
        if pose is not None:
            self._goal.position = (pose[0], pose[1], 2 * FLOOR)
            self._goal.wxyz = upright(pose[2])

    def _show_ellipse(self, estimate: Estimate | None, where: Array, magnify: float) -> None:
        self._ellipse.visible = estimate is not None and estimate.valid
        if not self._ellipse.visible or estimate is None:
            return
        values, vectors = np.linalg.eigh(estimate.covariance[:2, :2])
        radii = 3.0 * magnify * np.sqrt(np.clip(values, 0.0, 25.0))
        round_ = vectors @ (radii[:, None] * np.array([np.cos(CIRCLE), np.sin(CIRCLE)]))
        turn = where[2] - estimate.pose[2]  # of odometry's frame in the picture
        c, s = np.cos(turn), np.sin(turn)
        points = np.full((len(CIRCLE), 3), FLOOR)
        points[:, 0] = where[0] + c * round_[0] - s * round_[1]
        points[:, 1] = where[1] + s * round_[0] + c * round_[1]
        self._ellipse.points = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)

    def _show_trail(self, feed: Feed) -> None:
        if len(feed.trail) == self._trail_points < (feed.trail.maxlen or 0):
            return
        self._trail_points = len(feed.trail)
        self._trail.visible = self._trail_points > 1
        if self._trail.visible:
            points = np.full((self._trail_points, 3), FLOOR, dtype=np.float32)
            points[:, :2] = np.array(feed.trail)
            self._trail.points = np.stack([points[:-1], points[1:]], axis=1)

    def _show_scan(self, scan: Scan | None, estimate: Estimate | None, offset: Array) -> None:
        self._scan.visible = scan is not None and self._laser is not None and estimate is not None
        if scan is None or self._laser is None or estimate is None or scan.t == self._scanned:
            return
        self._scanned = scan.t
        pose = moved(offset, estimate.pose + (scan.t - estimate.t) * estimate.velocity)
        seen = (scan.ranges < scan.farthest) & (scan.ranges > 0.0)
        bearings = scan.start + scan.increment * np.arange(len(scan.ranges))[seen]
        x = self._laser[0] + scan.ranges[seen] * np.cos(bearings)
        y = self._laser[1] + scan.ranges[seen] * np.sin(bearings)
        c, s = np.cos(pose[2]), np.sin(pose[2])
        points = np.full((max(1, len(x)), 3), -10.0, dtype=np.float32)
        if len(x):
            points[:, 0], points[:, 1] = pose[0] + c * x - s * y, pose[1] + s * x + c * y
            points[:, 2] = 0.2
        self._scan.points = points

    def _show_votes(self, status: BaseStatus | None, where: Array) -> None:
        votes = [] if status is None else [(n, v) for n, v in status.votes.items() if len(v) == 4]
        arrows = [(vote_colour(n), v[:2]) for n, v in votes if v[3] > 0]
        if status is not None:
            arrows.append(((30, 30, 30), list(status.chosen[:2])))
        c, s = np.cos(where[2]), np.sin(where[2])
        points, colours = [], []
        for height, (colour, (vx, vy)) in enumerate(arrows):
            way = SECONDS * np.array([c * vx - s * vy, s * vx + c * vy, 0.0])
            if np.hypot(way[0], way[1]) > 0.02:
                start = np.array([where[0], where[1], 1.0 + 0.03 * height])
                points.append([start, start + way])
                colours.append(colour)
        self._put(self._votes, points, colours)

    def _show_forces(self, truth: Truth | None) -> None:
        points, colours = [], []
        for name, force in (truth.forces if truth is not None else {}).items():
            assert truth is not None
            if name != "box" and name in truth.bodies and np.linalg.norm(force) > 0.5:
                start = np.array(truth.bodies[name][:3])
                points.append([start, start + PER_NEWTON * np.array(force)])
                colours.append(RED)
        self._put(self._forces, points, colours)

    @staticmethod
    def _put(handle: Any, points: list[list[Array]], colours: list[tuple[int, int, int]]) -> None:
        handle.visible = bool(points)
        if points:
            handle.points = np.array(points, dtype=np.float32)
            handle.colors = np.array(colours, dtype=np.uint8)

    def _show_ink(self, feed: Feed) -> None:
        pieces = feed.ink.pieces
        if len(self._ink) > len(pieces) or (
            self._ink and self._ink[-1][0] > len(pieces[len(self._ink) - 1])
        ):  # wiped
            for _, handle in self._ink:
                handle.remove()
            self._ink.clear()
        for number, piece in enumerate(pieces):
            drawn = self._ink[number][0] if number < len(self._ink) else 0
            if len(piece) == drawn:
                continue
            points = np.full((len(piece), 2, 3), 0.002, dtype=np.float32)
            points[:, :, :2] = np.array(piece)
            if number < len(self._ink):
                handle = self._ink[number][1]
                handle.points = points
                self._ink[number] = (len(piece), handle)
            else:
                handle = self._scene.add_line_segments(
                    f"/board/ink/{number}",
                    points=points,
                    colors=INK,
                    thickness=4,
                    thickness_units="screen",
                )
                self._ink.append((len(piece), handle))


def vote_colour(name: str) -> tuple[int, int, int]:
    """A colour that goes with a behaviour's name, always the same."""
    hue = sum(ord(c) * (i + 7) for i, c in enumerate(name)) % 360 / 360
    r, g, b = colorsys.hls_to_rgb(hue, 0.45, 0.7)
    return round(255 * r), round(255 * g), round(255 * b)
