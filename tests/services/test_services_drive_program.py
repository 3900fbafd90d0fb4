"""A program that drives the platform, through all services in lockstep."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from deploy.task import Task
from services.run import run_lockstep
from services.topics import ARM_STATUS, TRUTH
from sim.scenario import Scenario

PROGRAM = """INTERFACE = r1; INITIAL = D;
BEGIN NAME = D; TYPE = Drive_to; X = -0.12; Y = 0.1; Heading = 10 deg;
    TRANSITION[Arrived] = End; TRANSITION[Blocked] = H; END
BEGIN NAME = H; TYPE = Hold; Time = 60; TRANSITION[Timeout] = End; END
"""


def test_a_program_sends_the_platform_and_goes_on_when_it_is_there(tmp_path: Path) -> None:
    """Arm, base and observer agree on the goal: the truth is within 20 mm and 2.5 deg of it, near
    rest, when the program ends."""
    file = tmp_path / "drive.hds"
    file.write_text(PROGRAM)
    run = run_lockstep(Scenario(task=Task(program=str(file))), seed=3, duration=8.0, after=0.2)
    assert run.result["outcome"] == "finished"
    statuses = run.log.series(ARM_STATUS)
    assert statuses[-1].event == "Arrived"
    assert {s.goal_number for s in statuses} == {0, 1}
    truth = run.log.series(TRUTH)[-1]
    assert np.hypot(truth.pose[0] + 0.12, truth.pose[1] - 0.1) < 0.02
    assert abs(np.degrees(truth.pose[2]) - 10.0) < 2.5
    assert np.abs(truth.velocity).max() < 0.05
