"""Reach and Carry: both palms onto the line across the box, and the line moved up and down."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.grasping.glide import Glide
from arm.grasping.scene import Scene

Array = NDArray[np.float64]


_UP = np.array([0.0, 0.0, 1.0])


class Reach(Objective):
    """Φ_reach: both palms onto the line through the box's middle, across its sides.

    Two constraints a palm, so that it may slide along the line. Within ``dead`` of the line it asks
    for no motion, but keeps its rows: what is subject to it shall not leave the line.

    Attributes:
        dead: radius of the dead zone [m].
        glide: of the palms, along and up, against their targets.
    """

    name = "reach"
    FASTEST = 0.51
    """Of a palm, in the middle of its way [m/s]."""

    def __init__(self) -> None:
        self.dead = 0.0
        self.glide = Glide((2, 2), self.FASTEST)

    def offsets(self, scene: Scene) -> Array:
        """From each palm to its target, along and up, shape (2, 2) [m]."""
        assert scene.box is not None
        along, p = scene.box.along, scene.box.p
        return np.array([[along @ (p - x), p[2] - x[2]] for x in scene.palms.p])

    def drift(self, scene: Scene) -> Array:
        """Velocity of the targets along and up, shape (2, 2) [m/s]."""
        assert scene.box is not None
        v = [float(scene.box.along @ scene.box.velocity), 0.0]
        return np.array([v, v])

    def error(self, kinematics: Any) -> Array:
        """Distances of the palms from their targets, shape (2,) [m]."""
        return np.asarray(np.linalg.norm(self.offsets(kinematics), axis=1))

    def begin(self, scene: Scene) -> float:
        """Start from rest; how long it will take [s], the same for both palms."""
        took = self.glide.duration(float(self.error(scene).max()))
        self.glide.begin(took)
        return took

    def speeds(self, offsets: Array, dt: float) -> Array:
        """Of both palms against their targets, along and up, shape (2, 2) [m/s]."""
        distance = np.maximum(np.linalg.norm(offsets, axis=1, keepdims=True), 1e-9)
        return self.glide.step(offsets * np.maximum(1.0 - self.dead / distance, 0.0), dt)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Towards the line, both palms at once."""
        scene: Scene = kinematics
        assert scene.box is not None
        axes = np.array([scene.box.along, _UP])
        rate = self.drift(scene) + self.speeds(self.offsets(scene), dt)
        J = [axes @ palm[:3] for palm in scene.palms.J]
        return Rows(np.concatenate(J), rate.ravel())


class Carry(Reach):
    """Φ_reach with the line moved up and down: each palm keeps its place on the box, in B.

    Attributes:
        height: how far above where it was captured the line is [m], and ``speed`` [m/s].
    """

    name = "carry"
    gain = 5.0
    fastest = 0.30

    def __init__(self) -> None:
        super().__init__()
        self.height = self.speed = 0.0
        self._places: list[Array] = []

    def capture(self, scene: Scene) -> None:
        """Keep the palms where they are from now on."""
        self.height = self.speed = 0.0
        self._places = [p.copy() for p in scene.palms.p]

    def offsets(self, scene: Scene) -> Array:
        """See ``Reach``."""
        assert scene.box is not None
        along = scene.box.along
        pairs = zip(self._places, scene.palms.p, strict=True)
        return np.array([[along @ (a - p), a[2] + self.height - p[2]] for a, p in pairs])

    def drift(self, scene: Scene) -> Array:
        """See ``Reach``."""
        return np.array([[0.0, self.speed]] * 2)

    def speeds(self, offsets: Array, dt: float) -> Array:
        """See ``Reach``: what is held follows at once."""
        distance = np.linalg.norm(offsets, axis=1, keepdims=True)
        wanted = np.minimum(self.gain * distance, self.fastest)
        return offsets * (wanted / np.maximum(distance, 1e-9))
