"""Come to rest, and keep that place."""

from __future__ import annotations

import numpy as np

from base.behaviour import Senses, Vote
from base.hold_still import HoldStill

REST = 0.01
"""At rest: no faster than this [m/s, rad/s]."""


class Stand:
    """As ``HoldStill``, but of where the platform has come to rest, not of where it was in motion.

    Held from the first moment, the place would be passed while braking, and returned to.
    """

    name = "stand"

    def __init__(self) -> None:
        self._still: HoldStill | None = None

    @property
    def state(self) -> str:
        """``stopping``, ``holding``, or ``returning`` to its place."""
        return "stopping" if self._still is None else self._still.state

    def vote(self, now: float, senses: Senses) -> Vote:
        """Zero until at rest."""
        moving = np.abs(senses.estimate.velocity).max() > REST or senses.command.any()
        if self._still is None and moving:
            return Vote(np.zeros(3))
        self._still = self._still or HoldStill()
        return self._still.vote(now, senses)
