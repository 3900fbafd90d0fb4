"""Guards and the abort edge on the arm: when a running program follows them."""

from __future__ import annotations

import pytest

from arm.hds import TIME
from arm.nodes import REGISTRY
from arm.nodes.quantities import QUANTITIES
from tests.arm.rig import AHEAD, EXACT, Rig, program, world_at
from tests.arm.test_arm_executive import at_rest, drawing, silent

HOLD = """
INTERFACE = r1;
INITIAL = Wait1;
ABORT = Away;
CONSTANT Long = 50 ms;
BEGIN
    NAME = Wait1; TYPE = Hold; Time = 10 s;
    TRANSITION[Timeout] = End;
    %s
END
BEGIN
    NAME = Away; TYPE = Goto_pose; Z = 20 mm;
    TRANSITION[Finished] = Rested;
END
BEGIN NAME = Rested; TYPE = End; END
"""


def holding(guard: str) -> Rig:
    """A rig that has just been told to hold, with a guard on it."""
    rig = at_rest(world_at(AHEAD + 0.1, mismatch=EXACT))
    rig.arm.start(program(HOLD % guard))
    return rig


def test_a_guard_on_the_time_leads_on_when_it_has_passed() -> None:
    """``Time > Long`` fires at the first tick behind 50 ms and not before; it is the event told."""
    rig = holding("TRANSITION[Time > Long] = Away;")
    rig.run(0.049)
    assert rig.status.node == "Wait1"
    rig.run(0.004)
    assert (rig.status.node, rig.status.event) == ("Away", "Time > Long")


def test_guards_that_always_hold_take_a_tick_each() -> None:
    """Two nodes that lead to each other by guards share the time: no tick goes on for ever."""
    text = """
    INTERFACE = r1; INITIAL = A;
    BEGIN NAME = A; TYPE = Hold; Time = 1; TRANSITION[Timeout] = End;
        TRANSITION[Distance > -1 m] = B; END
    BEGIN NAME = B; TYPE = Hold; Time = 1; TRANSITION[Timeout] = End;
        TRANSITION[Distance > -1 m] = A; END
    """
    rig = at_rest(world_at(AHEAD + 0.1, mismatch=EXACT))
    rig.arm.start(program(text))
    rig.run(0.02)
    assert 10 <= rig.status.transitions <= 20


def test_an_event_of_the_same_tick_goes_first() -> None:
    """A guard that holds at the very tick of the event is not followed."""
    text = """
    INTERFACE = r1; INITIAL = A;
    BEGIN NAME = A; TYPE = Hold; Time = 10 ms; TRANSITION[Timeout] = B;
        TRANSITION[Time >= 10 ms] = End; END
    BEGIN NAME = B; TYPE = Hold; Time = 1; TRANSITION[Timeout] = End; END
    """
    rig = at_rest(world_at(AHEAD + 0.1, mismatch=EXACT))
    rig.arm.start(program(text))
    rig.run(0.03)
    assert (rig.status.node, rig.status.event) == ("B", "Timeout")


def test_the_reason_of_an_earlier_event_is_not_told_with_a_guard() -> None:
    """Why the platform did not come is said while the next node runs, and no longer."""
    text = """
    INTERFACE = r1; INITIAL = Drive;
    BEGIN NAME = Drive; TYPE = Drive_to; X = 1 m; Y = 0;
        TRANSITION[Arrived] = End; TRANSITION[Blocked] = A; END
    BEGIN NAME = A; TYPE = Hold; Time = 1; TRANSITION[Timeout] = End;
        TRANSITION[Time > 50 ms] = B; END
    BEGIN NAME = B; TYPE = Hold; Time = 1; TRANSITION[Timeout] = End; END
    """
    rig = at_rest(world_at(AHEAD + 0.1, mismatch=EXACT))
    rig.arm.start(program(text))
    rig.until(lambda: rig.status.node == "A", limit=4.0)
    assert rig.status.reason.startswith("the platform came no nearer")
    rig.until(lambda: rig.status.node == "B", limit=0.1)
    assert (rig.status.event, rig.status.reason) == ("Time > 50 ms", "")


def test_a_guard_on_the_force_ends_a_stroke() -> None:
    """A stroke at 1.5 N is left by ``Force > 1 N`` though it is not finished."""
    text = """
    INTERFACE = r1; INITIAL = Approach;
    BEGIN NAME = Approach; TYPE = Whiteboard_approach; Force = 1 N; MaxX = 900 mm; Speed = 40;
        TRANSITION[Contact] = Line; TRANSITION[Out_of_Reach] = End; END
    BEGIN NAME = Line; TYPE = Whiteboard_line; Length = 30; Direction = 225; Force = 150;
        TRANSITION[Finished] = End; TRANSITION[Force > 1.2 N] = Away; END
    BEGIN NAME = Away; TYPE = Goto_pose; Z = 20 mm; TRANSITION[Finished] = End; END
    """
    rig = at_rest()
    rig.arm.start(program(text))
    rig.until(lambda: rig.status.node == "Away", limit=5.0)
    assert rig.status.event == "Force > 1.2 N"
    rig.until_state("finished")


@pytest.mark.parametrize("when", ["running", "paused"])
def test_abort_goes_to_the_abort_node_and_on_from_there(when: str) -> None:
    """From a running and from an interrupted node; the program then ends in its own way."""
    rig = holding("")
    rig.run(0.05)
    if when == "paused":
        rig.arm.pause()
        rig.run(0.05)
    rig.arm.abort()
    rig.run(0.01)
    assert (rig.status.state, rig.status.node, rig.status.event) == ("running", "Away", "Abort")
    rig.until_state("finished")
    assert rig.status.node == "Rested"


def test_an_abort_that_is_interrupted_at_once_goes_on_in_the_abort_node() -> None:
    """Not in the node that was aborted."""
    rig = holding("")
    rig.run(0.05)
    rig.arm.abort()
    rig.sense = silent
    rig.step()
    rig.sense = lambda estimate: estimate
    rig.run(0.05)
    assert rig.arm.state == "safe_hold"
    rig.arm.resume()
    rig.until_state("finished", 5.0)
    assert rig.status.node == "Rested"


def test_abort_without_an_abort_node_lets_go_and_ends() -> None:
    """A stroke that is aborted leaves the board; the program is over."""
    rig = drawing()
    rig.arm.abort()
    rig.run(0.5)
    assert (rig.status.state, rig.status.node) == ("finished", "End")
    assert rig.arm._felt.value < 0.1


def test_abort_without_a_program_is_refused() -> None:
    """There is nothing to abort before the start and after the end."""
    rig = at_rest()
    with pytest.raises(ValueError, match="no program to abort: the arm is idle"):
        rig.arm.abort()


def test_every_type_offers_the_common_quantities() -> None:
    """Whatever is declared can be guarded: a program looks at each in every type."""
    names = [q.name for q in (TIME, *QUANTITIES)]
    for kind in REGISTRY.values():
        if not kind.terminal:
            assert [q.name for q in kind.offers][: len(names)] == names
