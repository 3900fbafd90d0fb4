"""Inward: each palm presses on its side of the box."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.grasping.glide import Glide
from arm.grasping.model import SIDES
from arm.grasping.rows import stack
from arm.grasping.scene import Scene
from arm.grasping.shape import Preshape, gaps

Array = NDArray[np.float64]


class Inward(Objective):
    """Φ_f: each palm presses inward with a reference force.

    The force is a torque J^T f at the palm's middle (``force``); its rows only damp. A velocity,
    weighed by the inertia, would not be a pure force, and turn the palm onto its heel. Until both
    palms touch the one that does presses lightly: table friction holds the box against no more.

    Attributes:
        goal: force when both touch [N].
        force: force asked for at each palm, inward, shape (2,) [N].
        gaps: palms stay this far in front of the box's sides, shape (2,) [m]; below 0: go on until
            they touch.
        quick: palms go to ``BRAKES`` before the sides in the time of their ``glide``, and only from
            there on at the speed at which they may touch.
        glide: of the palms inward, while they touch nothing.

    Args:
        pad: stiffness of the palms [N/m]. While the force rises they go on by what their pads give
            way: held up by the damping instead, they would be turned onto an edge.
    """

    name = "force"
    BRAKES = 0.001
    """In front of the side where the box is believed to be a palm is slow [m]."""
    LIGHT = 5.0
    RAMP = 160.0
    SPEED, FAST, CLOSES = 0.08, 0.30, 6.0
    DAMPING = 0.0005
    CREEP = 0.01
    INTEGRAL, MOST = 4.0, 10.0
    LEAN, LEAN_RATE, LEAN_MOST = 300.0, 300.0, 8.0

    def __init__(self, pad: float) -> None:
        self._pad = pad
        self.goal = 25.0
        self.force = np.zeros(2)
        self.gaps = np.full(2, -1.0)
        self.quick = False
        self.glide = Glide((2,), self.FAST)
        self._middle: Array | None = None
        self._leaning = 0.0
        self._reference = np.zeros(2)
        self._integral = np.zeros(2)

    def reset(self) -> None:
        """Press no more."""
        self.glide.begin()
        self.force[:] = self._reference[:] = self._integral[:] = 0.0
        self.gaps[:] = -1.0
        self.keep(None)

    def error(self, kinematics: Any) -> Array:
        """Reference less measured force, shape (2,) [N]."""
        return np.asarray(self._reference - kinematics.feel.force)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Approach, or damping about the reference; sets ``force``."""
        scene: Scene = kinematics
        assert scene.box is not None
        n, feel = scene.box.across, scene.feel
        J, rate = [], []
        lean = self._lean(scene)
        approach = self._approach(scene, dt)
        for i, side in enumerate(SIDES):
            if feel.yielding[i]:
                self.force[i] = 0.0
                self.glide.stop(i)
                continue
            inward = -side * n
            J.append(inward @ scene.palms.J[i][:3])
            if not feel.touches[i]:
                self._reference[i] = self._integral[i] = self.force[i] = 0.0
                rate.append(approach[i])
                continue
            self.glide.stop(i)
            goal = self.goal if feel.both else self.LIGHT
            if self._reference[i] == 0.0:
                self._reference[i] = self.LIGHT
            step = self.RAMP * dt
            change = min(max(goal - self._reference[i], -step), step)
            self._reference[i] += change
            error = self._reference[i] - feel.force[i]
            integral = self._integral[i] + self.INTEGRAL * error * dt
            self._integral[i] = min(max(integral, -self.MOST), self.MOST)
            self.force[i] = self._reference[i] + self._integral[i] + side * lean
            damping = min(max(self.DAMPING * error, -self.CREEP), self.CREEP)
            rate.append(damping + change / dt / self._pad)
        return stack(J, rate)

    def keep(self, scene: Scene | None) -> None:
        """Keep the middle between the palms where it is in B from now on; None lets it go."""
        self._middle = None if scene is None else 0.5 * (scene.palms.p[0] + scene.palms.p[1])
        self._leaning = 0.0

    def _lean(self, scene: Scene) -> float:
        """Force by which the left palm presses more and the right one less [N].

        Two forces that only oppose each other leave what they hold free along their line.
        """
        if self._middle is None:
            return 0.0
        assert scene.box is not None
        n = scene.box.across
        off = float(n @ (0.5 * (scene.palms.p[0] + scene.palms.p[1]) - self._middle))
        total = self._leaning + self.LEAN_RATE * off * scene.dt
        self._leaning = min(max(total, -self.LEAN_MOST), self.LEAN_MOST)
        lean = self.LEAN * off + self._leaning
        return min(max(lean, -self.LEAN_MOST), self.LEAN_MOST)

    def _approach(self, scene: Scene, dt: float) -> Array:
        """Speeds inward of palms that touch nothing, shape (2,) [m/s]."""
        heel = Preshape.OPEN * float(scene.half_palm[2])  # nearer than the middle by this
        left = gaps(scene) - heel
        touches = scene.feel.touches
        if touches[0] != touches[1]:
            # the box's other side is where its width says, not where it was seen
            left[touches.index(False)] = scene.width - float(scene.size[1]) - 2.0 * heel
        way = np.full(2, self.glide.servo(self.SPEED))
        if self.quick:
            way = np.maximum(left - self.BRAKES, way)
        speed = self.glide.step(way, dt, self.SPEED)
        outside = np.clip(self.CLOSES * (left - self.gaps), -self.FAST, self.FAST)
        return np.where(self.gaps >= 0.0, np.minimum(speed, outside), speed)
