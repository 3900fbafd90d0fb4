"""What the joints want by themselves: off their ends, and towards their posture at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.grasping.model import JOINTS
from arm.grasping.rows import NOTHING

Array = NDArray[np.float64]


class Ends(Objective):
    """Keeps every joint off its ends, above everything else: back to ``MARGIN`` from them.

    Args:
        lower, upper: ends of the joints, shape (14,) [rad].
    """

    name = "ends"
    gain = 4.0
    MARGIN = 0.08

    def __init__(self, lower: Array, upper: Array) -> None:
        self._lower, self._upper = lower + self.MARGIN, upper - self.MARGIN
        self._identity = np.eye(JOINTS)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Of the joints that are too near to an end."""
        q = kinematics.palms.q
        off = np.minimum(np.maximum(q, self._lower), self._upper) - q
        near = np.abs(off) > 1e-9
        if not near.any():
            return NOTHING
        return Rows(self._identity[near], self.gain * off[near])


class Rest(Objective):
    """Joints towards their posture at rest, with what freedom is left."""

    name = "posture"
    gain = 1.0
    fastest = 0.6

    def __init__(self, target: Array) -> None:
        self.target = target
        self._identity = np.eye(JOINTS)

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """All joints."""
        rate = self.gain * (self.target - kinematics.palms.q)
        return Rows(self._identity, np.clip(rate, -self.fastest, self.fastest))
