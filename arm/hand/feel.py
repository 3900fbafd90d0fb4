"""What three fingertips feel: load cells averaged, tared and turned into contacts.

A contact is found by ``touch.contact_from_wrench``; its normal is smoothed over updates, since a
normal that is noisy by 0.02 rad would make references jump by a third of a millimetre.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from arm.hand.model import FINGERS
from arm.hand.touch import contact_from_wrench

Array = NDArray[np.float64]

TOUCH = 0.25
"""Force from which on a tip touches: more than ten deviations of a mean of 20 samples [N]."""
SMOOTH = 0.5
"""Weight of a new normal."""
DEAD = 1e-9
"""A cell whose readings differ by less does not live [N]."""


class Feel:
    """Means over an update of 20 ms, and the contacts they tell.

    Args:
        radius: of the tips [m].

    Attributes:
        force: of the world on each tip, in B, shape (3, 3) [N].
        moment: about the tips' middles, in B, shape (3, 3) [N m].
        normals: smoothed, into the object, shape (3, 3); of a tip that touches nothing the last.
        touching: which tips do, shape (3,).
        sharp: size of the force on each tip, of the newest sample alone, shape (3,) [N].
    """

    def __init__(self, radius: float) -> None:
        self.radius = radius
        self._tare = np.zeros((3, 6))
        self._sum = np.zeros((3, 6))
        self._count = 0
        self.force = np.zeros((3, 3))
        self.moment = np.zeros((3, 3))
        self.normals = np.zeros((3, 3))
        self.sharp = np.zeros(3)
        self.touching = np.zeros(3, dtype=bool)
        self._met = np.zeros(3, dtype=bool)

    def forget(self) -> None:
        """Of the contacts; the tare stays."""
        self._met[:] = False
        self.touching[:] = False
        self.normals[:] = 0.0
        self._sum[:] = 0.0
        self._count = 0

    def add(self, cells: Array) -> None:
        """Take a sample of all cells, shape (3, 6)."""
        self._sum += cells
        self._count += 1
        self.sharp = np.linalg.norm(cells[:, :3] - self._tare[:, :3], axis=1)

    def mean(self) -> Array:
        """Of the samples since the last call, shape (3, 6)."""
        out = self._sum / max(1, self._count)
        self._sum = np.zeros((3, 6))
        self._count = 0
        return out

    def tare(self, samples: Array) -> list[int]:
        """Learn what cells read in the air, shape (n, 3, 6); returns the fingers that are dead.

        A cell is dead if its readings do not vary, or are not finite.
        """
        self._tare = np.nan_to_num(samples.mean(axis=0))
        alive = np.isfinite(samples).all(axis=(0, 2)) & (np.ptp(samples, axis=0).max(1) > DEAD)
        return [i for i in range(FINGERS) if not alive[i]]

    def update(self, rotations: Array) -> None:
        """Turn the samples since the last update into contacts.

        Args:
            rotations: R_BT of the tips, shape (3, 3, 3).
        """
        wrench = self.mean() - self._tare
        for i in range(FINGERS):
            f, m = wrench[i, :3], wrench[i, 3:]
            self.force[i], self.moment[i] = rotations[i] @ f, rotations[i] @ m
            self.touching[i] = bool(f @ f > TOUCH * TOUCH)
            if not self.touching[i]:
                continue
            n = rotations[i] @ contact_from_wrench(f, m, self.radius)[1]
            if self._met[i]:
                n = self.normals[i] + SMOOTH * (n - self.normals[i])
                n /= np.linalg.norm(n)
            self.normals[i] = n
            self._met[i] = True

    def points(self, middles: Array) -> Array:
        """Where the tips touch, given their middles (3, 3) in B [m]."""
        return middles + self.radius * self.normals
