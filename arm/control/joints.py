"""Objectives of the joints themselves: a posture, and keeping away from joint limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from arm.control.algebra import Composable, chain
from arm.control.objective import Objective, Rows, smooth

if TYPE_CHECKING:
    from arm.model import Kinematics

Array = NDArray[np.float64]

MARGIN = 0.15
"""Distance to a limit at which avoiding it begins [rad]."""


class Posture(Objective):
    """Draws the joints towards a posture with what freedom is left.

    Args:
        target: joint positions, shape (n,) [rad].
        gain: [1/s].
        tolerance: radius of the goal region [rad].
    """

    name = "posture"

    def __init__(self, target: Array, gain: float = 1.0, tolerance: float = 0.0) -> None:
        self.target = target
        self.gain = gain
        self.tolerance = tolerance
        self._identity = np.eye(len(target))

    def error(self, kinematics: Kinematics) -> Array:
        """From the joints to the posture, shape (n,) [rad]."""
        return self.target - kinematics.q

    def jacobian(self, kinematics: Kinematics) -> Array:
        """Identity."""
        return self._identity


class JointLimit(Objective):
    """Keeps one joint away from its limits; inactive further than a margin away.

    Active, it holds the joint back and moves it out of the margin, whatever is subject to it.

    Args:
        joint: index.
        lower: limit [rad].
        upper: limit [rad].
        margin: where the goal region ends: this far from both limits [rad].
        gain: [1/s].
    """

    def __init__(
        self, joint: int, lower: float, upper: float, margin: float = MARGIN, gain: float = 4.0
    ) -> None:
        self.name = f"limit{joint + 1}"
        self.joint, self.lower, self.upper = joint, lower, upper
        self.margin = min(margin, 0.25 * (upper - lower))
        self.gain = gain

    def error(self, kinematics: Kinematics) -> Array:
        """How far into the margin, towards its edge, shape (1,) [rad]; 0 outside it."""
        q = float(kinematics.q[self.joint])
        low, high = self.lower + self.margin, self.upper - self.margin
        return np.array([min(max(q, low), high) - q])

    def jacobian(self, kinematics: Kinematics) -> Array:
        """Of this one joint, shape (1, n)."""
        J = np.zeros((1, len(kinematics.q)))
        J[0, self.joint] = 1.0
        return J

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Back to the edge of the margin; smoothly more active over its first half."""
        error = self.error(kinematics)
        activation = smooth(2.0 * abs(float(error[0])) / self.margin)
        if activation <= 0.0:
            return Rows(np.zeros((1, len(kinematics.q))), error, 0.0)
        return Rows(self.jacobian(kinematics), self.gain * error, activation)


def joint_limits(lower: Array, upper: Array, margin: float = MARGIN) -> Composable:
    """Avoiding every joint's limits, shapes (n,) [rad]: one objective a joint.

    Their rows are orthogonal, so that their order among each other does not matter.
    """
    pairs = enumerate(zip(lower.tolist(), upper.tolist(), strict=True))
    out = chain(tuple(JointLimit(i, lo, hi, margin) for i, (lo, hi) in pairs))
    out.name = "limits"
    return out
