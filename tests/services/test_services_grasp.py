"""The grasp as a whole, in lockstep."""

from __future__ import annotations

from typing import Any

import pytest

from services.trials.experiments.grasp_box import Options, run
from services.trials.grasp_run import Recorded, run_trial
from sim.scenario import Scenario, load_scenario


def changed(**world: Any) -> Scenario:
    """In front of a box that differs."""
    scenario = load_scenario("reach_to_grasp")
    box = scenario.world.box
    assert box is not None
    other = scenario.world.model_copy(update={"box": box.model_copy(update=world)})
    return scenario.model_copy(update={"world": other})


def ended(log: Recorded) -> str:
    """The node in which the program ended."""
    assert log.status[-1].state == "finished"
    return log.status[-1].node


@pytest.mark.parametrize("variant", ["sequential", "parallel"])
def test_a_box_is_lifted_upright_and_held(variant: Any) -> None:
    """Without slip, without tilt, and far from what hurts a hand."""
    row = run(0, Options(variant=variant, hold=0.5))
    assert row["success"], row["end"]
    assert row["tilt_deg"] < 2.0
    assert row["slip_mm"] < 1.0
    assert row["peak_force_n"] < 60.0


def test_a_box_too_heavy_is_found_out_by_its_load_and_left_standing() -> None:
    """6 kg: it does not leave the table, and the end says how heavy it felt."""
    log = run_trial(changed(mass=6.0), 0, 1.0)
    assert ended(log) == "Too_heavy"
    assert "kg" in log.status[-1].reason
    assert max(m.bodies["box"][2] for m in log.truth) < 0.845


def test_a_box_on_its_side_is_not_touched() -> None:
    """The program ends before the arms move."""
    log = run_trial(changed(on_side=True), 0, 1.0)
    assert ended(log) == "On_side"


def test_a_push_of_the_base_in_mid_grip_is_recovered_from() -> None:
    """260 N s while both palms press."""
    row = run(3, Options(push="base", impulse=260.0, phase="grip", hold=0.5))
    assert row["pushed_s"] is not None
    assert row["success"], row["end"]
