"""Probing, the baseline: lift, move through the air, touch again (Platt, section 4.1.2).

One reading a probe, so that what counts is how far a probe dares to move and how long it takes.
The paper gives "at least one second"; a probe here takes as long as its way does, and no less.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Probing:
    """How probes are made.

    Attributes:
        lift: off the surface before moving along it [m].
        speed: through the air [m/s].
        touch_speed: at which the surface is met [m/s].
        settle: until a touch can be read [s].
        least: a probe never takes less [s].
        gain: of a displacement, over that of one sliding update.
        most: farthest move along the surface [m].
    """

    lift: float = 0.02
    speed: float = 0.2
    touch_speed: float = 0.04
    settle: float = 0.2
    least: float = 1.0
    gain: float = 4.0
    most: float = 0.03

    def path(self, points: ArrayLike, normals: ArrayLike, dx: ArrayLike) -> Array:
        """Where each contact goes: lifted, moved, and as far in as it looks for the surface.

        Args:
            points: of contact, (k, 3) [m].
            normals: into the object, unit, (k, 3).
            dx: displacements of one sliding update, tangent, (k, 3) [m].

        Returns:
            Way points after the one they are at, (3, k, 3) [m]; the last approaches along the old
            normal, the only one known, down to as far below the surface as it was above.
        """
        x, n = np.asarray(points, dtype=float), np.asarray(normals, dtype=float)
        wanted = self.gain * np.asarray(dx, dtype=float)
        longest = float(np.linalg.norm(wanted, axis=1).max(initial=0.0))
        if longest > self.most:
            wanted *= self.most / longest
        lifted = x - self.lift * n
        return np.stack([lifted, lifted + wanted, x + wanted + self.lift * n])

    def seconds(self, points: ArrayLike, path: Array, touched: ArrayLike) -> float:
        """How long a probe takes, all contacts together.

        Args:
            points: where it began, (k, 3) [m].
            path: as of ``path``.
            touched: where it ended, (k, 3) [m].
        """
        x, end = np.asarray(points, dtype=float), np.asarray(touched, dtype=float)
        air = np.linalg.norm(path[0] - x, axis=1) + np.linalg.norm(path[1] - path[0], axis=1)
        down = np.linalg.norm(end - path[1], axis=1)
        needed = air / self.speed + down / self.touch_speed + self.settle
        return max(self.least, float(needed.max()))
