"""Motion objectives of the tip: position, distance to a line, orientation of the tool."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import GAIN, Objective, Rows, edge

if TYPE_CHECKING:
    from arm.model import Kinematics

Array = NDArray[np.float64]

__all__ = ["GAIN", "Line", "Orientation", "Position"]


class Position(Objective):
    """Keeps the tip on a moving target along some directions.

    Args:
        axes: unit vectors in O that are controlled, shape (m, 3).
        gain: decay of the error [1/s].
        tolerance: radius of the goal region [m]; 0 keeps the objective always active.
    """

    name = "position"

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

    def error(self, kinematics: Kinematics) -> Array:
        """From the tip to the target along the axes, shape (m,) [m]."""
        return self.axes.dot(self.target - kinematics.p)

    def jacobian(self, kinematics: Kinematics) -> Array:
        """Of the tip's position along the axes."""
        return self.axes.dot(kinematics.J[:3])

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Velocity of the target plus gain times error, less what the platform does."""
        velocity = self.gain * (self.target - kinematics.p)
        velocity += self.velocity
        velocity -= kinematics.drift[:3]
        activation = edge(self.error(kinematics), self.tolerance) if self.tolerance > 0.0 else 1.0
        return Rows(self.jacobian(kinematics), self.axes.dot(velocity), activation)


class Line(Position):
    """Keeps the tip on a line, anywhere along it: its goal is a set, not a point.

    So that a controller subject to it may slide along the line, as Φ_reach of Platt et al. lets
    the palms do.

    Args:
        direction: of the line in O, shape (3,); any length but 0.
        gain: decay of the distance [1/s].
        tolerance: radius of the goal region about the line [m].

    Raises:
        ValueError: the direction has no length.
    """

    name = "line"

    def __init__(self, direction: Array, gain: float = GAIN, tolerance: float = 0.0) -> None:
        if not np.linalg.norm(direction) > 0:
            raise ValueError("a line needs a direction")
        # the other two columns of a full QR are an orthonormal basis across the direction
        across = np.linalg.qr(np.asarray(direction, dtype=float)[:, None], mode="complete")[0]
        super().__init__(np.ascontiguousarray(across[:, 1:].T), gain, tolerance)

    def through(self, point: Array, velocity: Array | None = None) -> None:
        """Put the line through ``point`` in O [m], which moves with ``velocity`` [m/s]."""
        self.track(point, np.zeros(3) if velocity is None else velocity)


class Orientation(Objective):
    """Keeps the tool's orientation at R_OT.

    Args:
        target: R_OT, shape (3, 3).
        gain: decay of the error [1/s].
        tolerance: radius of the goal region [rad]; 0 keeps the objective always active.
    """

    name = "orientation"

    def __init__(self, target: Array, gain: float = GAIN, tolerance: float = 0.0) -> None:
        self.target = target
        self.gain = gain
        self.tolerance = tolerance

    def error(self, kinematics: Kinematics) -> Array:
        """Sine of the angle still to go about the common axis, shape (3,) in O."""
        # half the sum of cross products of the axes
        (_, xy, xz), (yx, _, yz), (zx, zy, _) = kinematics.R.dot(self.target.T).tolist()
        return np.array([0.5 * (yz - zy), 0.5 * (zx - xz), 0.5 * (xy - yx)])

    def jacobian(self, kinematics: Kinematics) -> Array:
        """Of the tool's angular velocity."""
        return kinematics.J[3:]

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Gain times the rotation still to go, less what the platform does."""
        error = self.error(kinematics)
        rate = self.gain * error - kinematics.drift[3:]
        return Rows(kinematics.J[3:], rate, edge(error, self.tolerance))
