"""Commands that the base means to give stand in for those that come late, and for no longer."""

from __future__ import annotations

import pytest

from observer.commands import STILL, CommandHistory

SLOW, FAST, FASTER = (0.1, 0.0, 0.0), (0.2, 0.0, 0.0), (0.3, 0.0, 0.0)


def planned() -> CommandHistory:
    """A command at 1 s, with two planned to follow it."""
    history = CommandHistory(silence=0.12, period=0.05)
    history.insert(1.0, SLOW)
    history.plan(1.0, [FAST, FASTER])
    return history


def test_planned_commands_act_until_the_drive_would_stop() -> None:
    """The newest, then the planned ones each in its time, then nothing."""
    history = planned()
    assert [history.at(t) for t in (1.04, 1.06, 1.11, 1.13)] == [SLOW, FAST, FASTER, STILL]
    pieces = history.segments(1.02, 1.2)
    assert [value for _, value in pieces] == [SLOW, FAST, FASTER, STILL]
    assert [duration for duration, _ in pieces] == pytest.approx([0.03, 0.05, 0.02, 0.08])


def test_a_command_that_comes_replaces_what_was_planned() -> None:
    """Whatever was meant, what was commanded is what counts."""
    history = planned()
    history.insert(1.05, SLOW)
    assert history.at(1.06) == SLOW
    assert history.segments(1.02, 1.09) == [
        (pytest.approx(0.03), SLOW),
        (pytest.approx(0.04), SLOW),
    ]


def test_a_plan_of_an_older_command_is_not_heeded() -> None:
    """It was made before the newest was known."""
    history = CommandHistory()
    history.insert(1.0, SLOW)
    history.insert(1.05, FAST)
    history.plan(1.0, [FASTER])
    assert history.at(1.08) == FAST
