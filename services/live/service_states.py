"""What the supervisor takes a service to be in: ``service_states.hds`` beside this file."""

from __future__ import annotations

from pathlib import Path

from arm.hds import Event, NodeType, registry
from arm.hds.machine import Machine

FILE = Path(__file__).with_name("service_states.hds")

_ENDED = Event("Ended", "It has ended as it was to.")

STATES = registry(
    NodeType(
        "Down",
        doc="No process.",
        events=(Event("Due", "It is time to start it."), _ENDED),
    ),
    NodeType(
        "Up",
        doc="A process.",
        events=(
            Event("Heard", "Its heartbeat came."),
            Event(
                "Hung",
                "Its heartbeat has made no progress, or its loop has stood still, for too long.",
            ),
            Event("Died", "The process is gone."),
            _ENDED,
        ),
    ),
)


def service_states(name: str) -> Machine:
    """The machine of a service that is not started yet."""
    return Machine(FILE, STATES, f"{name} is", {})
