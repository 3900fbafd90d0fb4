"""Yield: a palm that is pushed too hard gives way."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.grasping.rows import stack
from arm.grasping.scene import Scene

Array = NDArray[np.float64]


class Yield(Objective):
    """A palm pushed harder than ``limit`` goes where it is pushed, above everything else.

    Objectives along nearly the same direction pass such a palm over (``Feel.yielding``): both
    could be had, by a large motion across.

    Attributes:
        limit: [N].
    """

    name = "yield"
    gain = 0.02
    fastest = 1.5

    def __init__(self) -> None:
        self.limit = 50.0

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Along the force on each palm that is pushed too hard."""
        scene: Scene = kinematics
        J, rate = [], []
        for i in range(2):
            size = float(np.linalg.norm(scene.feel.pushed[i]))
            scene.feel.yielding[i] = size > self.limit
            if size > self.limit:
                way = scene.palms.R[i] @ (scene.feel.pushed[i] / size)
                J.append(way @ scene.palms.J[i][:3])
                rate.append(min(self.gain * (size - self.limit), self.fastest))
        return stack(J, rate)
