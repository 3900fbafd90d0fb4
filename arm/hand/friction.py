"""Coulomb friction in the joints: fed forward as described, and corrected by how the joints move.

A described friction is off by a fifth, and what is off comes with the sign of the motion. What the
torques of the last period, less weight, touch and described friction, have not done to the motion
is taken for it (a disturbance observer), at most by the share that a description may be off.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from arm.hand.model import JOINTS, Placed

Array = NDArray[np.float64]

WIDTH = 0.01
"""Speed over which the feed-forward changes sign [rad/s]."""
RATE = 20.0
"""With which the correction follows what is seen [1/s]."""
UNSURE = 0.25
"""Largest correction, as a share of what is fed forward [1]."""


class Friction:
    """What to add to the torques, of the driven joints.

    Args:
        coulomb: friction to feed forward, shape (11,) [N m]; zeros: nothing is ever added.
    """

    def __init__(self, coulomb: Array) -> None:
        self._coulomb = coulomb
        self._none = not coulomb.any()
        self._fed = np.zeros(JOINTS)
        self._sent = np.zeros(JOINTS)
        self._qd = np.zeros(JOINTS)
        self._lost = np.zeros(JOINTS)

    def see(self, dt: float, at: Placed, touch: Array) -> None:
        """Take in how the joints moved under the torques sent last.

        Args:
            dt: since the last call [s].
            at: the hand as it is.
            touch: force of the world on each tip, in B, shape (3, 3) [N].
        """
        if self._none:
            return
        told = self._sent - self._fed - at.h + np.einsum("ikj,ik->j", at.JL, touch)
        moved = at.M @ (at.qd - self._qd)
        self._lost += RATE * (dt * (told - self._lost) - moved)
        most = UNSURE * self._coulomb
        self._lost = np.clip(self._lost, -most, most)
        self._qd = at.qd.copy()

    def against(self, rate: Array) -> Array:
        """Torques against the friction of joints that are to move at a rate (11,) [rad/s]."""
        self._fed = self._coulomb * np.tanh(rate / WIDTH)
        return self._fed + self._lost

    def sent(self, tau: Array) -> None:
        """These torques go to the motors, shape (11,) [N m]."""
        self._sent = tau
