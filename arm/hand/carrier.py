"""Keeps the palm on its way in the world while the platform moves under it.

Where the palm is meant to be is a pose in O. From it and from the observer's estimate follow the
pose and twist that the palm needs in B, and from those the arm's joint references, by the damped
inverse at the references themselves: the loop is closed by the joints (``Law.follow``), not here.
Without ``compensate`` the platform is taken to stand, and the palm goes where the platform goes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from arm.hand.model import ARM, JOINTS, HandModel
from arm.hand.moving import into, seen_from, turned
from arm.model import Base

Array = NDArray[np.float64]

GAIN = 20.0
"""With which errors of the references' own pose go [1/s]."""
DAMPING = 1e-5
"""lambda^2 of the inverse."""
POSTURE = 0.5
"""Towards the joints at the start, in what the palm leaves free [1/s]."""
FASTEST = 2.0
"""Of a reference [rad/s]."""
MARGIN = 0.03
"""References keep this distance from joints' limits [rad]."""


class Carrier:
    """Joint references for a palm that goes its way in O.

    Args:
        model: of arm and hand.

    Attributes:
        R, p: where the palm is meant to be, X_OH: (3, 3), (3,) [m].
        error: of the references, distance of the palm from there [m].
    """

    def __init__(self, model: HandModel) -> None:
        self._model = model
        self.R, self.p = np.eye(3), np.zeros(3)
        self.error = 0.0
        self._home = np.zeros(7)
        self._base: Base | None = None

    def capture(self, reference: Array, base: Base, compensate: bool = True) -> None:
        """Start where the joint references (11,) put the palm now."""
        R, p, _ = self._model.palm_at(reference)
        self._base = None if compensate else base
        R_OB = turned(base)
        self.R, self.p = R_OB @ R, R_OB @ p + [base.pose[0], base.pose[1], 0.0]
        self._home = reference[ARM].copy()
        self.error = 0.0

    def follow(
        self, dt: float, base: Base, velocity: Array, reference: Array
    ) -> tuple[Array, Array]:
        """Advance the place meant by ``velocity`` (3,) in O [m/s], and the references after it.

        Args:
            dt: since the last call [s].
            base: motion of the platform.
            velocity: of the palm in O.
            reference: of the driven joints now, shape (11,) [rad].

        Returns:
            New references and their rates, shape (11,) each.
        """
        self.p = self.p + dt * velocity
        still = np.zeros(3)
        if self._base is not None:
            base, moving = self._base, still
        else:
            moving = into(base, base.velocity)
        R_OB = turned(base)
        p_B = seen_from(base, self.p)
        R, p, J = self._model.palm_at(reference)
        spin = np.array([0.0, 0.0, moving[2]])
        twist = np.concatenate(
            [-spin, R_OB.T @ velocity - [moving[0], moving[1], 0.0] - np.cross(spin, p_B)]
        )
        turn = Rotation.from_matrix(R_OB.T @ self.R @ R.T).as_rotvec()
        # what is left once the twist has done its part of this tick
        left = np.concatenate([turn, p_B - p]) - dt * twist
        self.error = float(np.linalg.norm(left[3:]))
        twist += GAIN * left
        inverse = J.T @ np.linalg.inv(J @ J.T + DAMPING * np.eye(6))
        own = POSTURE * (self._home - reference[ARM])
        rates = np.zeros(JOINTS)
        rates[ARM] = own + inverse @ (twist - J @ own)
        rates *= min(1.0, FASTEST / max(float(np.abs(rates).max()), 1e-9))
        out = reference + dt * rates
        low, high = self._model.lower[ARM] + MARGIN, self._model.upper[ARM] - MARGIN
        out[ARM] = np.clip(out[ARM], low, high)
        return out, rates
