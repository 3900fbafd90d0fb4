"""When the platform stands whatever its task: ``platform_states.hds`` beside this file."""

from __future__ import annotations

from pathlib import Path

from arm.hds import Event, NodeType, registry
from arm.hds.machine import Machine

FILE = Path(__file__).with_name("platform_states.hds")

_ARM_FAILED = Event("Arm_failed", "The arm is silent or stands in a failure.")
_RESUME = Event("Resume", "Asked to resume.")

STATES = registry(
    NodeType(
        "Votes",
        doc="Behaviours vote on the velocity.",
        events=(
            Event("Lost", "No usable estimate of its own motion."),
            _ARM_FAILED,
            Event("Stuck", "It gets nowhere."),
            Event("Shut_down", "The process ends."),
        ),
    ),
    NodeType(
        "Waits",
        doc="It stands until what is missing is there again.",
        events=(Event("Better", "It is there again."), _RESUME, _ARM_FAILED),
    ),
    NodeType(
        "Asks",
        doc="It stands until a person says something.",
        events=(_RESUME, Event("New_task", "It was given another task."), _ARM_FAILED),
    ),
)


def platform_states() -> Machine:
    """The machine, under way."""
    return Machine(FILE, STATES, "the platform is", {"Resume": "resume", "New_task": "goal"})
