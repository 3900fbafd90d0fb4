"""Time in a node: the parameter and event that bound it, for any room's node types."""

from __future__ import annotations

from arm.hds.nodetype import Event, Parameter

TIMEOUT = Parameter(
    "Timeout",
    unit="s",
    lo=0.01,
    hi=3600,
    default=float("inf"),
    doc="Raise Timeout after this time in the node.",
)
TIMEOUT_EVENT = Event("Timeout", "The node took longer than its Timeout.", needs="Timeout")


class Clock:
    """Counts time in a node and says when it has run out.

    Args:
        limit: [s]; by default it never runs out.
    """

    def __init__(self, limit: float = float("inf")) -> None:
        self.limit = limit
        self.elapsed = 0.0

    def step(self, dt: float) -> bool:
        """Count ``dt`` [s]; True once the limit has passed."""
        self.elapsed += dt
        return self.elapsed >= self.limit - 1e-9
