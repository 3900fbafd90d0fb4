"""Walking through a program by typed commands."""

from __future__ import annotations

import pytest

from arm.hds import Registry, check_text
from arm.hds.walk import Refused, Walk, split_events


@pytest.fixture
def walk(types: Registry, good: str) -> Walk:
    """The good program with two guards, at its start."""
    guards = "TRANSITION[Force > 5 N] = Retract1; TRANSITION[Time > 2 s] = Rest1;"
    text = good.replace("FGain = 0.00002;", f"FGain = 0.00002; {guards}")
    made, findings = check_text(text, "x.hds", types)
    assert made is not None, findings
    return Walk(made, types)


def test_events_lead_to_the_end(walk: Walk) -> None:
    """Each event goes where the program says."""
    for event, node in [
        ("Contact", "Line1"),
        ("Finished", "Retract1"),
        ("Finished", "Choose1"),
        ("Done", "Rest1"),
    ]:
        walk.do(event)
        assert walk.node == node
    assert walk.ended
    with pytest.raises(Refused, match="the program ended in 'Rest1'"):
        walk.do("Done")


def test_a_refused_event_changes_nothing_and_names_the_valid_ones(walk: Walk) -> None:
    """With the nearest one."""
    with pytest.raises(Refused, match=r"did you mean 'Contact'\? .*Contact, Out_of_Reach, Abort"):
        walk.do("Contac")
    assert walk.node == "Approach1"


@pytest.mark.parametrize("typed", ["Force 6 N", "force 6", "FORCE 600 cN", "Force = 6 N"])
def test_a_quantity_fires_the_guard_it_makes_hold(walk: Walk, typed: str) -> None:
    """In any unit of its dimension, bare in its own, upper and lower case alike."""
    walk.do("Contact")
    assert "no guard" in walk.do("Force 4 N")
    assert "-[Force > 5 N]-> Retract1" in walk.do(typed)
    assert walk.node == "Retract1"


def test_a_guard_that_holds_on_entry_waits_for_the_next_tick(walk: Walk) -> None:
    """As in the robot: an event may come first."""
    walk.do("Force 6 N")
    shown = walk.do("Contact")
    assert walk.node == "Line1"
    assert "Force > 5 N -> Retract1   (holds now)" in shown
    walk.do("tick")
    assert walk.node == "Retract1"


def test_time_starts_anew_in_every_node(walk: Walk) -> None:
    """Three seconds in one node are none in the next."""
    walk.do("Time 3 s")
    walk.do("Contact")
    assert "no guard" in walk.do("tick")
    walk.do("Time 2.5")
    assert walk.node == "Rest1"


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("Force 6 mm", "given in N, not in mm"),
        ("Force six", "'six' is not a number; write Force 6 N"),
        ("Force 6 Nn", "unknown unit 'Nn'"),
        ("Forse 6 N", "did you mean 'Force'?"),
        ("Force", "is a quantity: give its value"),
        ("Finished", "does not handle 'Finished'"),
    ],
)
def test_what_cannot_be_understood_says_what_can(walk: Walk, typed: str, said: str) -> None:
    """Nothing changes."""
    with pytest.raises(Refused) as refused:
        walk.do(typed)
    assert said in str(refused.value)
    assert walk.node == "Approach1"


def test_back_undoes_one_command_at_a_time(walk: Walk) -> None:
    """Values too; at the start there is nothing to undo."""
    walk.do("Force 6 N")
    walk.do("Contact")
    walk.do("back")
    assert walk.node == "Approach1"
    walk.do("back")
    walk.do("Contact")
    assert "no guard" in walk.do("tick")
    walk.do("restart")
    with pytest.raises(Refused, match="nothing to go back to"):
        walk.do("back")


def test_abort_leads_to_the_abort_node_from_anywhere(walk: Walk) -> None:
    """Which is End without an ABORT line."""
    walk.do("Contact")
    walk.do("Abort")
    assert walk.node == "End"
    assert walk.ended


def test_where_help_and_quit(walk: Walk) -> None:
    """An empty line shows where one is."""
    assert walk.do("") == walk.do("where")
    assert "Contact -> Line1" in walk.do("where")
    assert "restart" in walk.do("help")
    walk.do("quit")
    assert walk.done


def test_events_are_split_at_commas_semicolons_and_lines() -> None:
    """A quantity keeps its blanks."""
    assert split_events("a, b;Force 6 N\n\n c ,") == ["a", "b", "Force 6 N", "c"]
