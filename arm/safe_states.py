"""The states of whatever runs programs on arms: ``arm_states.hds`` beside this file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from arm.hds import Event, NodeType, Step, registry
from arm.hds.machine import Machine

FILE = Path(__file__).with_name("arm_states.hds")

_FAILED = Event("Failed", "An input is too old or invalid, or the motion cannot go on.")
_DONE = Event("Done", "The program has come to its end.")
_GIVE_UP = Event("Give_up", "Asked to abort: to the program's abort node.")
_STOP = Event("Stop", "Asked to stop: the program is dropped.")
_PAUSE = Event("Pause", "Asked to pause.")

STATES = registry(
    NodeType(
        "Rest",
        doc="No program.",
        events=(
            Event("Start", "Asked to start one."),
            _STOP,
            Event("Shut_down", "The process ends."),
        ),
    ),
    NodeType(
        "Work",
        doc="A program has the arm.",
        events=(
            Event("Late", "What it goes by is older than it should be."),
            Event("On_time", "It is young again."),
            *(_PAUSE, _FAILED, _DONE, _GIVE_UP, _STOP),
        ),
    ),
    NodeType(
        "Halt",
        doc="A program is interrupted and can go on.",
        events=(
            Event("Resume", "Asked to resume: first back to where it was."),
            Event("Enter", "Asked to resume: its node is entered anew."),
            *(_FAILED, _DONE, _GIVE_UP, _STOP),
        ),
    ),
    NodeType(
        "Return",
        doc="On the way back to where a program was interrupted.",
        events=(Event("Back", "It is there."), *(_PAUSE, _FAILED, _DONE, _GIVE_UP, _STOP)),
    ),
    NodeType("Latch", doc="Stopped.", events=(Event("Reset", "A person has looked at it."),)),
)

REQUESTS = {
    "Start": "start",
    "Pause": "pause",
    "Resume": "resume",
    "Give_up": "abort",
    "Stop": "stop",
    "Reset": "reset",
}
"""Events people ask for, and the verb they ask with."""


def arm_states(who: str, told: Callable[[Step, str], None]) -> Machine:
    """The machine in state ``idle``.

    Args:
        who: for texts, "the arm is".
        told: called with every change of state and its reason.
    """
    return Machine(FILE, STATES, who, REQUESTS, told)
