"""Goal regions of the refining sequence, each part of the one before (Platt et al., Eq 2).

They nest by construction: to be in one is to be in all before it. Each has a wider edge for those
who are in than for those who come, or what happens on the edge would switch to and fro.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from arm.grasping.scene import Scene

NAMES = ("approach", "reach", "contact", "comply")
"""In the order in which the sequence reaches them."""


@dataclass(frozen=True)
class Edges:
    """Where regions begin for those who come, and end for those who are in."""

    distance: tuple[float, float] = (0.68, 0.70)
    """Of the box from B, over the floor [m]."""
    farthest: tuple[float, float] = (0.71, 0.72)
    """Of the farther side's middle from B, ahead: beyond it a palm can hold, and not lift [m]."""
    nearest: tuple[float, float] = (0.50, 0.46)
    """Nearer than this it is too near [m]."""
    aside: tuple[float, float] = (0.10, 0.14)
    """Of the box from straight ahead [m]."""
    facing: tuple[float, float] = (0.42, 0.52)
    """Yaw of the box in B [rad]."""
    line: tuple[float, float] = (0.014, 0.024)
    """Of a palm from the line [m]."""
    force: tuple[float, float] = (15.0, 9.0)
    """Of each palm on the box [N]."""
    moment: tuple[float, float] = (0.30, 0.80)
    """On each palm, about the axes in its face [N m]."""


class Regions:
    """Which goal regions the robot is in, looked at every tick."""

    def __init__(self, edges: Edges | None = None) -> None:
        self.edges = edges or Edges()
        self._in = dict.fromkeys(NAMES, False)
        self.line = math.inf

    def __getitem__(self, name: str) -> bool:
        return self._in[name]

    def step(self, scene: Scene, held: bool) -> None:
        """Look at a tick.

        Args:
            scene: of this tick.
            held: the box is off the table: it is where the palms are, and nowhere to drive to.
        """
        e = self.edges
        box = scene.box
        if box is None:
            self._in = dict.fromkeys(NAMES, False)
            self.line = math.inf
            return
        inside = self._in
        x, y = float(box.p[0]), float(box.p[1])
        distance = math.hypot(x, y)
        yaw = abs(math.atan2(-float(box.R[0, 1]), float(box.R[1, 1])))
        was = 1 if inside["approach"] else 0
        far = x + 0.5 * float(box.size[1]) * math.sin(yaw)
        near = distance <= e.distance[was] and x >= e.nearest[was] and far <= e.farthest[was]
        inside["approach"] = held or (near and abs(y) <= e.aside[was] and yaw <= e.facing[was])
        n = box.across
        self.line = max(
            float(np.linalg.norm((p - box.p) - n * (n @ (p - box.p)))) for p in scene.palms.p
        )
        was = 1 if inside["reach"] else 0
        inside["reach"] = inside["approach"] and (held or self.line <= e.line[was])
        least = float(scene.feel.force.min())
        was = 1 if inside["contact"] else 0
        inside["contact"] = inside["reach"] and scene.feel.both and least >= e.force[was]
        moment = float(np.linalg.norm(scene.feel.moment[:, [0, 2]], axis=1).max())
        was = 1 if inside["comply"] else 0
        inside["comply"] = inside["contact"] and moment <= e.moment[was]
