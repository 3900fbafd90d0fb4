"""How the palms are held before they touch and while they do: outside, upright, flat."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.grasping.glide import Glide
from arm.grasping.model import SIDES
from arm.grasping.rows import NOTHING, stack
from arm.grasping.scene import Scene

Array = NDArray[np.float64]


def gaps(scene: Scene) -> Array:
    """Of the palms to the box's sides, along the line, shape (2,) [m]."""
    assert scene.box is not None
    box = scene.box
    out = np.array(SIDES) * ((np.array(scene.palms.p) - box.p) @ box.across)
    return np.asarray(out - 0.5 * float(box.size[1]) - float(scene.half_palm[1]))


class Clearance(Objective):
    """Keeps the palms outside while they go around the box."""

    name = "clearance"
    FASTEST = 0.2

    def __init__(self) -> None:
        self.gaps = np.full(2, 0.05)
        self.glide = Glide((2,), self.FASTEST)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Along the line, to ``gaps`` [m] in front of the box's sides."""
        scene: Scene = kinematics
        assert scene.box is not None
        speed = self.glide.step(self.gaps - gaps(scene), dt)
        J, rate = [], []
        for i, side in enumerate(SIDES):
            if scene.feel.yielding[i]:
                self.glide.stop(i)
                continue
            J.append(side * scene.box.across @ scene.palms.J[i][:3])
            rate.append(float(speed[i]))
        return stack(J, rate)


class Preshape(Objective):
    """Palms upright beside the box, fingers ahead and a little open: heels touch first.

    Attributes:
        firm: palms that touch keep it as well; otherwise they are left to Φ_m.
    """

    name = "preshape"
    FASTEST = 1.2
    OPEN = 0.02
    """Of the fingers, outwards [rad]."""

    def __init__(self) -> None:
        self.firm = True
        self.glide = Glide((2, 3), self.FASTEST)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Turns of each palm towards its shape."""
        scene: Scene = kinematics
        assert scene.box is not None
        n, along = scene.box.across, scene.box.along
        c, s = math.cos(self.OPEN), math.sin(self.OPEN)
        turns = np.zeros((2, 3))
        for i, side in enumerate(SIDES):
            z = -(c * along + s * side * n)
            y = c * n - s * side * along
            E = scene.palms.R[i] @ np.array([np.cross(y, z), y, z])
            turns[i] = 0.5 * np.array([E[1, 2] - E[2, 1], E[2, 0] - E[0, 2], E[0, 1] - E[1, 0]])
        speed = self.glide.step(turns, dt)
        J, rate = [], []
        for i in range(2):
            if scene.feel.touches[i] and not self.firm:
                self.glide.stop(i)
                continue
            J.append(scene.palms.J[i][3:])
            rate.append(speed[i])
        if not J:
            return NOTHING
        return Rows(np.concatenate(J), np.concatenate(rate))


class Flat(Objective):
    """Φ_m: turns each palm that touches until it feels no moment about the axes in its face."""

    name = "moment"
    gain = 0.25
    fastest = 0.4

    def error(self, kinematics: Any) -> Array:
        """Moments on the palms about x and z of P, shape (2, 2) [N m]."""
        return np.asarray(kinematics.feel.moment[:, [0, 2]])

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """With the moment."""
        scene: Scene = kinematics
        J, rate = [], []
        for i in range(2):
            if not scene.feel.touches[i]:
                continue
            R = scene.palms.R[i]
            for axis in (0, 2):
                J.append(R[:, axis] @ scene.palms.J[i][3:])
                wanted = self.gain * float(scene.feel.moment[i, axis])
                rate.append(min(max(wanted, -self.fastest), self.fastest))
        return stack(J, rate)


class Keep(Objective):
    """Turn about the palm's normal: none while the box stands, the captured angle once lifted."""

    name = "roll"
    gain = 12.0

    def __init__(self) -> None:
        self._captured: list[float] | None = None

    def capture(self, scene: Scene) -> None:
        """Hold the angles of now."""
        self._captured = [self._angle(scene, i) for i in range(2)]

    def release(self) -> None:
        """Hold still, at any angle."""
        self._captured = None

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """About the normal of each palm that touches."""
        scene: Scene = kinematics
        J, rate = [], []
        for i in range(2):
            if not scene.feel.touches[i]:
                continue
            J.append(scene.palms.R[i][:, 1] @ scene.palms.J[i][3:])
            held = self._captured
            rate.append(0.0 if held is None else self.gain * (held[i] - self._angle(scene, i)))
        return stack(J, rate)

    @staticmethod
    def _angle(scene: Scene, i: int) -> float:
        """Of x of P about y of P, from upright [rad]."""
        R = scene.palms.R[i]
        # about +y of P, z turns to x
        return math.atan2(float(R[2, 2]), float(R[2, 0]))
