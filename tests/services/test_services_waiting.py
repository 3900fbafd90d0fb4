"""Nobody has to guess what a running system waits for, or how far a run is."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from services.cli import progress as shown
from services.cli.waiting import NEEDS, Waiting
from services.live.plan import Plan
from services.live.supervisor import Event
from services.run import TOLD_TICKS, run_lockstep
from sim.scenario import load_scenario


def plan(until_finished: bool = True, duration: float | None = 120.0) -> Plan:
    """Of ``make demo``."""
    return Plan(Path(), Path(), duration=duration, until_finished=until_finished)


def test_a_safe_hold_says_the_way_on_and_when_it_ends() -> None:
    """``make demo`` on a busy machine: who reads the line knows what to type, and how long."""
    now = [100.0]
    waiting = Waiting(plan(), lambda: now[0])
    assert waiting.hear(Event(1.0, "arm", "running")) == ""
    now[0] = 112.0
    said = waiting.hear(Event(12.0, "arm", "safe_hold", "estimate is 61 ms old"))
    assert "steadyhand program resume" in said and "ends in 108 s" in said
    now[0] = 150.0
    line = waiting.__rich__().plain
    assert "steadyhand program resume" in line and "ends in 70 s" in line
    # another service's news do not hide it, the arm's do
    assert waiting.hear(Event(51.0, "base", "stopped")) == ""
    assert "program resume" in waiting.__rich__().plain
    waiting.hear(Event(52.0, "arm", "running"))
    assert "program resume" not in waiting.__rich__().plain


@pytest.mark.parametrize(("until_finished", "asks"), [(True, False), (False, True)])
def test_a_stop_asks_for_a_reset_unless_the_run_ends_with_it(
    until_finished: bool, asks: bool
) -> None:
    """Nobody is sent to a robot that is about to be shut down."""
    waiting = Waiting(plan(until_finished))
    said = waiting.hear(Event(1.0, "arm", "protective_stop", "force limit"))
    assert ("arm reset" in said) is asks


def test_without_a_limit_no_end_is_promised() -> None:
    """``up`` without ``--for`` goes on until Ctrl-C."""
    said = Waiting(plan(duration=None)).hear(Event(1.0, "arm", "paused"))
    assert said == NEEDS["paused"]
    assert "restarted" not in said


def test_a_run_tells_how_far_it_is() -> None:
    """In robot time, with the node or state, and to the end."""
    told: list[tuple[float, str]] = []
    scenario = load_scenario("base_alone")
    run_lockstep(scenario, 0, duration=1.0, progress=lambda at, words: told.append((at, words)))
    assert len(told) == 1000 // TOLD_TICKS
    assert told[-1][0] == pytest.approx(1.0) and told[-1][1]


def test_bars_are_for_terminals_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Piped, nothing of them is written; on a terminal something is."""
    for terminal in (False, True):
        file = io.StringIO()
        console = Console(file=file, force_terminal=terminal)
        monkeypatch.setattr(shown, "errors", console)
        with shown.progress("whiteboard", 60.0, "s") as tell:
            tell(30.0, "Line1")
        with shown.busy("writing"):
            pass
        assert bool(file.getvalue()) is terminal
        assert ("Line1" in file.getvalue()) is terminal
