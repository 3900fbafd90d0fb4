"""When two arms must stop: a joint near its end, or faster than it may be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from arm.grasping.model import TwoArmModel

Array = NDArray[np.float64]

MARGIN = 0.02
"""Distance to a joint's end that must be left [rad]."""
PATIENCE = 0.1
"""A push may drive a joint faster than its limit for this long [s]."""


class Limits:
    """Looks at every state.

    Args:
        model: of the arms.

    Attributes:
        joint_margin: smallest distance of a joint to its end [rad].
    """

    def __init__(self, model: TwoArmModel) -> None:
        arms = model.robot.arms
        self._lower, self._upper = model.q_lower, model.q_upper
        self._velocity = np.array(arms.velocity_limit * 2)
        self._names = arms.joints
        self._speed = np.zeros(len(self._names))
        self._fast = 0.0
        self.joint_margin = 0.0

    def violated(self, dt: float, q: Array, qd: Array) -> str | None:
        """Name and figures of a limit that is left, or None.

        Args:
            dt: since the last call [s].
            q: joint positions, shape (14,) [rad].
            qd: joint velocities, shape (14,) [rad/s].
        """
        self._speed += min(dt / 0.01, 1.0) * (qd - self._speed)
        share = np.abs(self._speed) / self._velocity
        self._fast = self._fast + dt if share.max() > 1.0 else 0.0
        self.joint_margin = float(np.minimum(q - self._lower, self._upper - q).min())
        if self._fast > PATIENCE:
            i = int(share.argmax())
            return f"velocity limit of {self._names[i]}: {self._speed[i]:.2f} rad/s"
        return None
