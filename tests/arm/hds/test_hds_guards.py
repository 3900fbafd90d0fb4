"""Guards and the abort edge in the runtime and in what the checker makes of them."""

import math

import pytest

from arm.hds import ABORT, TIME, Automaton, AutomatonError, Program, Registry, Step, check_text

TEXT = """
INTERFACE = r1;
INITIAL = Line1;
ABORT = Retract1;
CONSTANT Hard = 500 cN;
BEGIN
    NAME = Line1; TYPE = Whiteboard_line; Length = 50; Direction = 0; Speed = 40; Force = 150;
    TRANSITION[Force >= Hard] = Retract1;
    TRANSITION[Force < 0.1 N] = End;
    TRANSITION[Time > 2 min] = Done;
    TRANSITION[Finished] = Line2;
END
BEGIN
    NAME = Line2; LIKE = Line1; Direction = 90;
    TRANSITION[Distance > 30] = Retract1;
    TRANSITION[Force > 4 N] = Done;
    TRANSITION[Finished] = Done;
END
BEGIN NAME = Retract1; TYPE = Goto_pose; Speed = 100; TRANSITION[Finished] = Done; END
BEGIN NAME = Done; TYPE = End; END
"""
CALM = {"Force": 1.5, "Time": 1.0, "Distance": 0.0}


@pytest.fixture(scope="module")
def program(types: Registry) -> Program:
    """A program with guards, checked."""
    made, findings = check_text(TEXT, "guards.hds", types)
    assert made is not None and findings == [], findings
    return made


@pytest.fixture
def automaton(program: Program) -> Automaton:
    """The program, started."""
    made = Automaton(program)
    made.start()
    return made


def test_guards_are_in_si_and_know_their_place(program: Program) -> None:
    """Units and constants are resolved; the text stays as a person wrote it."""
    guards = program.nodes["Line1"].guards
    assert [(g.quantity, g.operator, g.limit, g.target) for g in guards] == [
        ("Force", ">=", 5.0, "Retract1"),
        ("Force", "<", 0.1, "End"),
        ("Time", ">", 120.0, "Done"),
    ]
    assert [g.text for g in guards] == ["Force >= Hard", "Force < 0.1 N", "Time > 2 min"]
    assert (guards[0].file, guards[0].line, guards[0].column) == ("guards.hds", 8, 16)


def test_a_like_node_replaces_guards_of_the_same_side_and_keeps_the_others(
    program: Program,
) -> None:
    """Its own come first; a bare limit has the quantity's unit; the other node is as it was."""
    node = program.nodes["Line2"]
    assert [g.text for g in node.guards] == [
        "Distance > 30 mm",
        "Force > 4 N",
        "Force < 0.1 N",
        "Time > 2 min",
    ]
    assert node.like == "Line1" and node.type == "Whiteboard_line"
    assert node.parameters["Direction"] == pytest.approx(math.pi / 2)
    assert node.parameters["Speed"] == program.nodes["Line1"].parameters["Speed"] == 0.04
    assert node.transitions == {"Finished": "Done"}
    assert program.nodes["Line1"].transitions == {"Finished": "Line2"}


def test_the_first_guard_that_holds_leads_on(automaton: Automaton) -> None:
    """Of two that hold the one written first; the history tells its text."""
    assert automaton.check_guards(CALM) is None and automaton.transitions == 0
    node = automaton.check_guards({**CALM, "Force": 6.0, "Time": 500.0})
    assert node is not None and node.name == "Retract1"
    assert automaton.history[-1] == Step("Force >= Hard", "Line1", "Retract1")
    assert automaton.transitions == 1 and automaton.guards == ()


@pytest.mark.parametrize(("force", "fires"), [(5.0, True), (math.nextafter(5.0, 0.0), False)])
def test_the_limit_itself_counts_as_the_operator_says(
    automaton: Automaton, force: float, fires: bool
) -> None:
    """``>=`` holds at the limit and not a double below it."""
    assert (automaton.check_guards({**CALM, "Force": force}) is not None) == fires


def test_no_guard_holds_for_what_is_not_known(automaton: Automaton) -> None:
    """NaN fires nothing; infinity is a value like any other."""
    assert automaton.check_guards(dict.fromkeys(CALM, math.nan)) is None
    assert automaton.check_guards({**CALM, "Time": math.inf}) is not None


def test_a_missing_value_is_an_error_and_changes_nothing(automaton: Automaton) -> None:
    """A guard is never passed over in silence."""
    with pytest.raises(AutomatonError, match=r"'Time > 2 min' of node 'Line1' needs .* 'Time'"):
        automaton.check_guards({"Force": 1.0})
    assert automaton.node.name == "Line1" and automaton.transitions == 0


def test_abort_leads_from_every_node_to_the_abort_node(program: Program) -> None:
    """Also from that node itself, and not from an end."""
    automaton = Automaton(program)
    for name in ("Line1", "Line2", "Retract1"):
        automaton.start()
        automaton.reset(name)
        assert automaton.fire(ABORT).name == "Retract1"
        assert ABORT not in automaton.events
    automaton.fire("Finished")
    with pytest.raises(AutomatonError, match="ended in 'Done'"):
        automaton.fire(ABORT)
    assert automaton.check_guards({}) is None


def test_without_an_abort_node_an_abort_ends_the_program(good: str, types: Registry) -> None:
    """The default is End."""
    program, _ = check_text(good, "a", types)
    assert program is not None and program.abort == "End"
    automaton = Automaton(program)
    automaton.start()
    assert automaton.fire(ABORT).terminal and automaton.finished


def test_an_abort_node_is_reached_by_aborts_alone(types: Registry) -> None:
    """A node that nothing but an abort leads to is no unreachable one."""
    text = TEXT.replace("[Force >= Hard] = Retract1", "[Force >= Hard] = Done")
    text = text.replace("[Distance > 30] = Retract1", "[Distance > 30] = Done")
    assert check_text(text, "a", types)[1] == []
    _, findings = check_text(text.replace("ABORT = Retract1;", ""), "a", types)
    assert [f.code for f in findings] == ["unreachable-node"]


def test_every_type_offers_the_time(types: Registry) -> None:
    """Whatever else it offers."""
    assert all(kind.quantity("Time") is TIME for kind in types.values())
