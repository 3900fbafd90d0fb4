"""The discrete runtime: where events lead, and how it refuses."""

import copy
import pickle

import pytest

from arm.hds import (
    END,
    Automaton,
    AutomatonError,
    Program,
    Registry,
    Step,
    UnhandledEvent,
    UnknownNode,
    check_text,
)


@pytest.fixture(scope="module")
def program(good: str, types: Registry) -> Program:
    """The good program, checked."""
    checked, _ = check_text(good, "whiteboard.hds", types)
    assert checked is not None
    return checked


def test_events_lead_along_the_transitions(program: Program) -> None:
    """The automaton starts at the initial node and follows the program to a declared end."""
    automaton = Automaton(program)
    assert not automaton.started and not automaton.finished
    assert automaton.start().name == "Approach1"
    assert automaton.events == ("Contact", "Out_of_Reach")
    names = [automaton.fire(e).name for e in ("Contact", "Finished", "Finished", "Done")]
    assert names == ["Line1", "Retract1", "Choose1", "Rest1"]
    assert automaton.finished and automaton.node.terminal and automaton.events == ()
    assert automaton.transitions == 4
    assert automaton.history[:2] == (
        Step("start", None, "Approach1"),
        Step("Contact", "Approach1", "Line1"),
    )


def test_the_predefined_end_is_a_terminal_node(program: Program) -> None:
    """Going to End finishes the program."""
    automaton = Automaton(program)
    automaton.start()
    assert automaton.fire("Out_of_Reach") is END
    assert automaton.node is END and automaton.finished


def test_an_unhandled_event_is_refused_with_the_valid_names(program: Program) -> None:
    """A wrong event changes nothing; the error names the node, the nearest and all events."""
    automaton = Automaton(program)
    automaton.start()
    with pytest.raises(UnhandledEvent) as caught:
        automaton.fire("contact")
    text = str(caught.value)
    assert "'Approach1'" in text and "did you mean 'Contact'?" in text and "Out_of_Reach" in text
    assert automaton.node.name == "Approach1" and automaton.transitions == 0


def test_nothing_fires_before_the_start_or_after_the_end(program: Program) -> None:
    """Firing needs a running program."""
    automaton = Automaton(program)
    with pytest.raises(AutomatonError, match="start"):
        automaton.fire("Contact")
    with pytest.raises(AutomatonError, match="start"):
        _ = automaton.node
    automaton.start()
    automaton.fire("Out_of_Reach")
    with pytest.raises(AutomatonError, match="ended in 'End'"):
        automaton.fire("Contact")


def test_reset_resumes_at_a_named_node(program: Program) -> None:
    """A program resumes at any declared node, also after its end, and keeps its count."""
    automaton = Automaton(program)
    automaton.start()
    automaton.fire("Out_of_Reach")
    assert automaton.reset("Retract1").name == "Retract1"
    assert not automaton.finished
    automaton.fire("Finished")
    assert automaton.transitions == 2
    assert automaton.history[2] == Step("reset", None, "Retract1")
    for name in ("retract", "End"):
        with pytest.raises(UnknownNode, match="Approach1, Line1, Retract1"):
            automaton.reset(name)


def test_start_starts_over(program: Program) -> None:
    """Starting again forgets count and history."""
    automaton = Automaton(program)
    automaton.start()
    automaton.fire("Contact")
    automaton.start()
    assert automaton.transitions == 0 and len(automaton.history) == 1


def test_history_is_bounded(program: Program) -> None:
    """A program that goes round for ever keeps only the newest steps."""
    automaton = Automaton(program, keep=5)
    automaton.start()
    for _ in range(10):
        for event in ("Contact", "Finished", "Finished", "Again"):
            automaton.fire(event)
    assert automaton.transitions == 40 and len(automaton.history) == 5
    assert automaton.history[-1] == Step("Again", "Choose1", "Approach1")


def test_programs_can_be_copied_and_sent(program: Program) -> None:
    """A program survives pickling and deep copies, so it can cross to another process."""
    assert pickle.loads(pickle.dumps(program)) == program
    assert copy.deepcopy(program) == program
