"""A reference that glides to its target with as little jerk as the time leaves.

Of all ways from rest to rest in a given time the quintic has the least integral of jerk squared
(Flash and Hogan 1985). Here it is a feedback law: at every tick the quintic from where things are
is begun anew (Hoff and Arbib 1993), so that a target which moves, or a palm which was pushed,
changes the jerk and nothing else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

PEAK = 1.875
"""Largest speed of the quintic from rest to rest, of its mean [1]."""
LATE = 1.5
"""The same of one that is under way, a lower bound: it stretches what is disturbed alone [1]."""


class Glide:
    """Speeds that lead to a target.

    Attributes:
        speed: of the reference, in the target's units a second.
        left: time to the target [s]; once it is below ``soonest`` a servo with that time constant
            remains: s³ + 9 s²/T + 36 s/T² + 60/T³ = 0, its slowest poles at (-2.7 ± 3.0i)/T.

    Args:
        shape: of the target.
        fastest: speed that is not to be exceeded by much, over all components.
        soonest: T [s].
    """

    def __init__(self, shape: tuple[int, ...], fastest: float, soonest: float = 0.25) -> None:
        self.fastest, self.soonest = fastest, soonest
        self.speed = np.zeros(shape)
        self._change = np.zeros(shape)
        self.left = 0.0

    def begin(self, duration: float = 0.0) -> None:
        """From rest, to be there in ``duration`` [s] (0: as soon as can be)."""
        self.speed[...] = self._change[...] = 0.0
        self.left = duration

    def stop(self, i: int) -> None:
        """A component is at rest."""
        self.speed[i] = self._change[i] = 0.0

    def servo(self, end: float) -> float:
        """The way for which ``step`` only comes to the speed ``end``, and keeps it."""
        return end * max(self.left, self.soonest)

    def duration(self, distance: float) -> float:
        """Of a way at ``fastest`` in its middle [s]."""
        return PEAK * distance / self.fastest

    def step(self, way: ArrayLike, dt: float, end: float = 0.0) -> Array:
        """Speed of the reference ``dt`` [s] on, for what is left of the way and a speed there."""
        e = np.asarray(way)
        far = float(np.abs(e).max(initial=0.0))
        T = max(self.left, self.soonest, LATE * far / self.fastest)
        jerk = ((60.0 * e / T - 36.0 * self.speed - 24.0 * end) / T - 9.0 * self._change) / T
        self._change += jerk * dt
        self.speed += self._change * dt
        self.left -= dt
        return self.speed.copy()
