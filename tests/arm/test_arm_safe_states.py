"""The safe states: what leads into them, what out, and that every executive goes by them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from arm.hds import UnhandledEvent, load
from arm.hds.machine import Machine
from arm.hds.product import verify_program
from arm.hds.specification_check import load_specification
from arm.program_runner import LATE
from arm.safe_states import FILE, STATES, arm_states
from tests.arm.rig import AHEAD, Rig, program, world_at
from tests.arm.test_arm_executive import STROKE

SPECIFICATION = FILE.with_suffix(".spec")


def machine() -> Machine:
    """The arm's, idle."""
    return arm_states("the arm is", lambda step, reason: None)


def test_the_states_keep_what_is_specified() -> None:
    """Nothing works again after a failure, nor moves after a protective stop, unasked."""
    states = load(FILE, STATES)
    verdict = verify_program(states, STATES, load_specification(SPECIFICATION, states, STATES))
    assert verdict.holds
    assert not verdict.unreached


def test_a_protective_stop_is_reached_from_every_state_and_left_by_reset_alone() -> None:
    """Also from rest, and with the reason."""
    for node in load(FILE, STATES).nodes:
        states = machine()
        states._automaton.reset(node)
        states.abort("too fast")
        assert (states.state, states.reason) == ("protective_stop", "too fast")
        assert states._automaton.events == ("Reset",)


def test_what_is_not_possible_is_refused_with_what_is() -> None:
    """A person reads what to ask for instead; a program cannot force it."""
    states = machine()
    with pytest.raises(ValueError, match="the arm is idle; possible now: start, stop"):
        states.require("Pause")
    with pytest.raises(UnhandledEvent):
        states.fire("Pause")


def test_changes_are_told_with_their_reason() -> None:
    """Once each."""
    told = []
    states = arm_states("the arm is", lambda step, reason: told.append((step.target, reason)))
    states.fire("Start")
    states.fire("Failed", "no estimate")
    assert told == [("Running", ""), ("Safe_hold", "no estimate")]


def test_a_late_estimate_slows_the_stroke_and_a_young_one_lets_it_go_on() -> None:
    """Degraded is no stop: the stroke goes on, slower, and at full speed afterwards."""
    rig = Rig(world_at(AHEAD)).run(0.02)
    rig.arm.start(program(STROKE.replace("Length = 30", "Length = 60")))
    rig.until_drawn(0.005)

    def speed() -> float:
        rig.run(0.3)
        since = len(rig.desired) - 50
        return float(np.linalg.norm(rig.desired[-1] - rig.desired[since]) / 0.049)

    on_time = speed()
    rig.sense = lambda estimate: replace(estimate, t=estimate.t - LATE - 0.005)
    slow = speed()
    assert rig.arm.state == "degraded"
    assert "old" in rig.status.reason
    rig.sense = lambda estimate: estimate
    again = speed()
    assert rig.arm.state == "running"
    assert slow == pytest.approx(on_time / 2, rel=0.1)
    assert again == pytest.approx(on_time, rel=0.1)
