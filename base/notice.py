"""Says that the platform is about to move, before it does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from base.behaviour import Vote
from services.messages import Array

WARNING = 0.5
"""How long it says so before the first motion [s]."""
LINGER = 1.0
"""After so long at rest people take it for standing, and are warned anew [s]."""
SLOW = 1e-3
"""What is wanted below this is no motion [m/s, rad/s]."""
AT_ONCE = frozenset({"give_way", "respond_to_contact"})
"""Behaviours that get out of somebody's way, for which half a second is too late."""


class Notice:
    """Holds a standing platform back for ``WARNING`` once it is wanted to move.

    Lights and sounds are driven by the state ``starting`` of the platform's status.
    """

    def __init__(self) -> None:
        self._since: float | None = None
        self._free = -np.inf

    def announce(self, now: float) -> None:
        """It will move at a time that is known: the warning counts from ``now`` [s] on."""
        if self._since is None:
            self._since = now

    def counts(self, now: float) -> bool:
        """Whether at ``now`` [s] a warning is being given; what for need not be asked meanwhile."""
        return self._since is not None and now - self._since < WARNING - 1e-9

    def holds(self, now: float, votes: Mapping[str, Vote], command: Array) -> bool:
        """Whether the platform is still to stand at ``now`` [s], and to say ``starting``.

        Args:
            now: robot time [s].
            votes: of all behaviours.
            command: (3,) newest V_OB_B.
        """
        if np.abs(command).max() > 0.0:
            self._free, self._since = now + LINGER, None
        wanting = {k for k, v in votes.items() if v.weight > 0 and np.abs(v.velocity).max() > SLOW}
        if now <= self._free or wanting & AT_ONCE:
            return False
        if self.counts(now):
            return True
        if not wanting:
            self._since = None
        elif self._since is None:
            self._since = now
        return self.counts(now)
