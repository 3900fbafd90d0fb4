"""Turns a carried box upright that has slipped between the palms."""

from __future__ import annotations

import math
from typing import Any

from arm.control.objective import Rows
from arm.grasping.scene import Scene
from arm.grasping.shape import Keep


class Level(Keep):
    """Turn about the palm's normal: the captured angle, and off it while the box leans.

    Two flat palms hold a box about their common line by friction alone. Thrown there by a push, it
    stays askew though neither the palms' angles nor the load cells show it; a camera does. Only
    what the camera is sure of is turned back, and no farther than ``MOST``.

    Attributes:
        carries: the box is off the table; on it nothing is turned.
    """

    LEANS = 0.05
    """The camera may be wrong by so much [rad]."""
    RIGHTS, FASTEST = 2.0, 0.4
    """Of what it leans more [1/s], and no faster than [rad/s]."""
    MOST = 0.6
    """[rad]"""

    def __init__(self) -> None:
        super().__init__()
        self.carries = False
        self._turned = 0.0

    def capture(self, scene: Scene) -> None:
        """Hold the angles of now."""
        super().capture(scene)
        self._turned = 0.0

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """About the normal of each palm that touches."""
        scene: Scene = kinematics
        box = scene.box
        if self.carries and box is not None and scene.feel.both and self._captured is not None:
            up = box.R[:, 2]
            lean = math.atan2(float(up @ box.along), float(up[2]))
            beyond = lean - min(max(lean, -self.LEANS), self.LEANS)
            rate = min(max(-self.RIGHTS * beyond, -self.FASTEST), self.FASTEST)
            turned = min(max(self._turned + rate * dt, -self.MOST), self.MOST)
            self._captured = [angle + turned - self._turned for angle in self._captured]
            self._turned = turned
        return super().rows(kinematics, dt)
