"""The limits of an arm with a pen: what it must never leave, and the name of the one it left."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm.joint_limits import EXCUSED, Ends, JointLimits
from arm.model import ArmModel

Array = NDArray[np.float64]

PATIENCE = 0.1
"""How long torque or reference may stand at its limit before the arm stops [s]."""
TRACKING = 0.15
"""Largest difference of reference and measured joint position [rad]."""


@dataclass
class Limits:
    """Watches one arm.

    Args:
        model: the arm as believed.
    """

    model: ArmModel

    def __post_init__(self) -> None:
        model, arm = self.model, self.model.robot.arm
        self._joints = JointLimits(arm.joints, model.q_lower, model.q_upper, arm.velocity_limit)
        self._names = arm.joints
        self._force = arm.force_limit
        self._reach = arm.reach
        self._saturated = 0.0
        self._clamped = 0.0
        self._reach_floor = 0.0

    @property
    def joint_margin(self) -> float:
        """Smallest distance of a joint to an end of its range [rad]."""
        return self._joints.joint_margin

    def ends(self, q: Array) -> Ends:
        """What the ends of the joints' ranges ask for at ``q``, shape (n,) [rad]."""
        return self._joints.ends(q)

    def excuse(self) -> None:
        """After a reset: a joint or reach limit that is still left may be come back from."""
        self._joints.excuse()
        self._reach_floor = -math.inf

    def reach_margin(self) -> float:
        """Distance left before the arm is stretched out, at the state last placed [m]."""
        return self._reach - self.model.stretch()

    def violated(
        self,
        dt: float,
        q: Array,
        qd: Array,
        q_ref: Array,
        wrench: Array,
        saturated: bool,
        clamped: bool,
        reach_margin: float | None,
    ) -> str | None:
        """Name and figures of the first limit that is left, or None.

        Args:
            dt: since the last call [s].
            q: measured joint positions, shape (n,) [rad].
            qd: measured joint velocities, shape (n,) [rad/s].
            q_ref: reference positions, shape (n,) [rad].
            wrench: force [N] and moment [N m] at the wrist, shape (6,).
            saturated: a torque was clamped at this tick.
            clamped: the reference's rates were clamped at this tick.
            reach_margin: see ``reach_margin`` [m]; None where it does not matter.
        """
        joints = self._joints.violated(dt, q, qd)
        if joints is not None:
            return joints
        force = math.hypot(*wrench[:3].tolist())
        if force > self._force:
            return f"force limit at the wrist: {force:.0f} N of {self._force:.0f} N"
        if reach_margin is not None:
            if reach_margin < self._reach_floor:
                return f"reach limit: {-1000 * reach_margin:.1f} mm beyond"
            self._reach_floor = min(max(self._reach_floor, reach_margin - EXCUSED), 0.0)
        error = q_ref - q
        if max(map(abs, error.tolist())) > TRACKING:
            error = np.abs(error)
            i = int(error.argmax())
            return f"tracking limit of {self._names[i]}: {error[i]:.2f} rad behind its reference"
        self._saturated = self._saturated + dt if saturated else 0.0
        if self._saturated > PATIENCE:
            return f"torque limit: reached for {1000 * self._saturated:.0f} ms"
        self._clamped = self._clamped + dt if clamped else 0.0
        if self._clamped > PATIENCE:
            return f"velocity limit of the reference: reached for {1000 * self._clamped:.0f} ms"
        return None
