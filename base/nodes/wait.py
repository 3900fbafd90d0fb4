"""Wait: stand still until somebody says that something has happened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from arm.hds import Event, NodeType, Parameter, ParameterValue
from base.nodes.hold import TIME, Hold
from base.nodes.node import Context, Step


class Wait(Hold):
    """Hold, until the event of the given name comes by request, or ``Time`` has passed.

    Control law: as ``Hold``. Goal region: the event has come while the node was running; one that
    comes when no node waits for it is refused, not kept. Domain: as ``Hold``.
    """

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        super().__init__(values)
        self._name = str(values["Event"])
        self._came = False

    def signal(self, name: str) -> None:
        """An event has come from outside.

        Raises:
            ValueError: it is not the one waited for.
        """
        if name != self._name:
            raise ValueError(f"the program waits for {self._name!r}, not for {name!r}")
        self._came = True

    def update(self, context: Context) -> Step:
        """Received once the event has come, else Timeout after ``Time``."""
        step = super().update(context)
        return replace(step, event="Received") if self._came else step


TYPE = NodeType(
    "Wait",
    parameters=(Parameter("Event", kind="word", doc="Name of the event waited for."), TIME),
    events=(
        Event("Received", "The event has come by request."),
        Event("Timeout", "Time is over.", needs="Time"),
    ),
    doc="Stand still until an event comes by request.",
    make=Wait,
)
