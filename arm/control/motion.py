"""Motion objectives of the tip: position along chosen axes, and orientation of the tool."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.model import Kinematics

Array = NDArray[np.float64]

GAIN = 8.0
"""Rate at which a position or orientation error of the reference decays [1/s]."""


class Position(Objective):
    """Keeps the tip on a moving target along some directions.

    Args:
        axes: unit vectors in O that are controlled, shape (m, 3).
        gain: decay of the error [1/s].
        tolerance: radius of the goal region [m]; 0 keeps the objective always active.
    """

    def __init__(self, axes: Array, gain: float = GAIN, tolerance: float = 0.0) -> None:
        self.axes = axes
        self.gain = gain
        self.tolerance = tolerance
        self.target = np.zeros(3)
        self.velocity = np.zeros(3)

    def track(self, target: Array, velocity: Array) -> None:
        """Set target p_OT [m] and its velocity in O [m/s], shape (3,)."""
        self.target = target
        self.velocity = velocity

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Velocity of the target plus gain times error, less what the platform does."""
        error = self.axes @ (self.target - kinematics.p)
        rate = self.axes @ (self.velocity - kinematics.drift[:3]) + self.gain * error
        return Rows(self.axes @ kinematics.J[:3], rate, edge(error, self.tolerance))


class Orientation(Objective):
    """Keeps the tool's orientation at R_OT.

    Args:
        target: R_OT, shape (3, 3).
        gain: decay of the error [1/s].
        tolerance: radius of the goal region [rad]; 0 keeps the objective always active.
    """

    def __init__(self, target: Array, gain: float = GAIN, tolerance: float = 0.0) -> None:
        self.target = target
        self.gain = gain
        self.tolerance = tolerance

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Gain times the rotation still to go, less what the platform does."""
        R, T = kinematics.R, self.target
        # half the sum of cross products of the axes: sine of the angle about the common axis
        E = R @ T.T
        error = -0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
        rate = self.gain * error - kinematics.drift[3:]
        return Rows(kinematics.J[3:], rate, edge(error, self.tolerance))


class Posture(Objective):
    """Draws the joints towards a posture with what freedom is left.

    Args:
        target: joint positions, shape (6,) [rad].
        gain: [1/s].
    """

    def __init__(self, target: Array, gain: float = 1.0) -> None:
        self.target = target
        self.gain = gain

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Gain times the distance, joint by joint."""
        return Rows(np.eye(len(self.target)), self.gain * (self.target - kinematics.q))


def edge(error: Array, tolerance: float) -> float:
    """Activation of an objective: 0 within half the tolerance, 1 outside it, smooth between."""
    if tolerance <= 0.0:
        return 1.0
    x = 2.0 * float(np.linalg.norm(error)) / tolerance - 1.0
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)
