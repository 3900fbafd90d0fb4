"""Arm alone, platform alone, both: a scenario says which services run."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from patience import PATIENCE
from pydantic import ValidationError

from services.run import run_lockstep, write_report
from services.topics import ARM_STATUS, BASE_COMMAND, BASE_STATUS, ESTIMATE, SERVICES, TRUTH
from sim.scenario import Scenario, ServiceName, load_scenario


def lateral(log: Any) -> np.ndarray:
    """Velocity of the true platform along its own y, shape (n,) [m/s]."""
    truth = log.series(TRUTH)
    heading = np.array([x.pose[2] for x in truth])
    velocity = np.array([x.velocity for x in truth])
    return np.cos(heading) * velocity[:, 1] - np.sin(heading) * velocity[:, 0]


def test_platform_alone_drives_its_program_without_an_arm_process(tmp_path: Path) -> None:
    """It finishes at its goal, within 3 cm and 2 degrees in truth; the report can be written."""
    scenario = load_scenario("base_alone")
    run = run_lockstep(scenario, 0)
    assert run.result["outcome"].startswith("finished")
    assert not run.log.series(ARM_STATUS)
    pose = run.log.series(TRUTH)[-1].pose
    assert scenario.task.base.goal is not None
    off = pose - np.array(scenario.task.base.goal)
    assert np.hypot(off[0], off[1]) < 0.03 and abs(off[2]) < np.radians(2)
    write_report(run.log, run.result, tmp_path, "alone")
    assert json.loads((tmp_path / "result.json").read_text())["line_rms_mm"] is None


def test_a_differential_platform_does_not_move_sideways() -> None:
    """Over a rough floor less than 1 mm/s, and no command asks for it."""
    run = run_lockstep(load_scenario("approach"), 3, duration=8.0)
    assert np.abs(lateral(run.log)).max() < 1e-3
    assert all(c.velocity[1] == 0.0 for c in run.log.series(BASE_COMMAND))
    assert np.hypot(*run.log.series(TRUTH)[-1].pose[:2]) > 0.3


def test_arm_alone_works_on_a_standing_platform() -> None:
    """Without a base process the observer is valid without commands, and the program runs."""
    run = run_lockstep(load_scenario("arm_alone"), 0, duration=3.0)
    assert not run.log.series(BASE_COMMAND) and not run.log.series(BASE_STATUS)
    assert run.log.series(ARM_STATUS)[-1].state == "running"
    assert all(e.valid for e in run.log.series(ESTIMATE) if e.t > 0.5)


def test_without_both_there_is_a_report_of_the_estimate(tmp_path: Path) -> None:
    """Nobody moves; nothing fails."""
    scenario = Scenario(services=("observer", "sim"))
    run = run_lockstep(scenario, 0, duration=1.0)
    assert run.result["outcome"] == "neither arm nor platform spoke"
    assert run.result["estimate_rms_mm"] < 1.0
    write_report(run.log, run.result, tmp_path, "nobody")


def test_services_are_those_there_are_in_starting_order() -> None:
    """A list that cannot run is refused with the reason."""
    assert get_args(ServiceName) == SERVICES
    assert Scenario().services == SERVICES
    assert Scenario(services=("base", "observer", "sim", "sim")).services == (
        "sim",
        "observer",
        "base",
    )
    for services, words in (
        (("observer", "base"), "without 'sim' there is no robot"),
        (("sim", "arm", "base"), "'arm' and 'base' cannot do without 'observer'"),
        (("sim", "legs"), "'sim', 'observer', 'arm' or 'base'"),
    ):
        with pytest.raises(ValidationError, match=words):
            Scenario.model_validate({"services": services})


@pytest.mark.processes
@pytest.mark.parametrize(("scenario", "absent"), [("base_alone", "arm"), ("arm_alone", "base")])
def test_processes_run_without_the_one_that_is_not_asked_for(
    tmp_path: Path, scenario: str, absent: str
) -> None:
    """Paced, so that whoever waited for the absent one would not come to an end."""
    command = [
        sys.executable,
        "-m",
        "services.cli",
        "up",
        scenario,
        "--no-console",
        "--paced",
        "--for",
        "0.2",
        "--hang",
        "30",
    ]
    command += ["--run-dir", str(tmp_path / "r"), "--out", str(tmp_path / "out"), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["success"]
    ready = [e["service"] for e in said["events"] if e["kind"] == "ready"]
    assert ready == ["recorder", *(name for name in SERVICES if name != absent)]
