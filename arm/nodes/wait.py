"""Wait: keep the tip still until somebody says that something has happened."""

from __future__ import annotations

from collections.abc import Mapping

from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.nodes.conditions import Conditions, free, stayed
from arm.nodes.hold import Hold
from arm.nodes.node import Context, Step


class Wait(Hold):
    """Hold, until the event of the given name comes by request, or ``Time`` has passed.

    Control law: as ``Hold``. Goal region: the event has come while the node was running; one that
    comes when no node waits for it is refused, not kept. Domain: as ``Hold``.
    """

    conditions = Conditions(goal=stayed, domain=free, good=("Received",))

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        super().__init__(values)
        self.name = str(values["Event"])
        self._came = False

    def signal(self, name: str) -> None:
        """An event has come from outside.

        Raises:
            ValueError: it is not the one waited for.
        """
        if name != self.name:
            raise ValueError(f"the program waits for {self.name!r}, not for {name!r}")
        self._came = True

    def update(self, context: Context) -> Step:
        """Received once the event has come, else Timeout after ``Time``."""
        step = super().update(context)
        if self._came:
            step.event = "Received"
        return step


TYPE = NodeType(
    "Wait",
    parameters=(
        Parameter("Event", kind="word", doc="Name of the event waited for."),
        Parameter("Time", unit="s", lo=0.0, hi=86400, default=float("inf"), doc="At most."),
    ),
    events=(
        Event("Received", "The event has come: steadyhand program event NAME."),
        Event("Timeout", "Time is over.", needs="Time"),
    ),
    doc="Keep the tip still until an event comes by request.",
    make=Wait,
)
