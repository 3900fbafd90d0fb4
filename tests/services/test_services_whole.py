"""The whole process chain: real services, real processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from patience import PATIENCE, Command, until

from deploy.robot import load_robot
from services import connect
from services.requests import NoAnswer
from services.run import run_lockstep
from services.script import Connection, Refused, Silent
from services.topics import ARM_COMMAND, ARM_STATUS, HEALTH, SERVICES, TRUTH
from sim.scenario import load_scenario

SCENARIO = """
duration = 12.0
[task]
program = "paper_fragment.hds"
start_at = 0.2
"""


def up(tmp_path: Path, *options: str) -> dict[str, Any]:
    """Result of ``steadyhand up`` of the paper's fragment."""
    scenario = tmp_path / "fragment.toml"
    scenario.write_text(SCENARIO)
    command = [
        sys.executable,
        "-m",
        "services.cli",
        "up",
        str(scenario),
        "--no-console",
        "--json",
        "--hang",
        "30",
        *options,
    ]
    command += ["--run-dir", str(tmp_path / "r"), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    result: dict[str, Any] = json.loads(done.stdout)["result"]
    return result


@pytest.mark.processes
def test_paced_processes_draw_the_papers_line_as_lockstep_does(tmp_path: Path) -> None:
    """The fragment as printed is drawn process to process, with the figures of lockstep."""
    result = up(tmp_path, "--paced", "--for", "8.2", "--seed", "3")
    assert result["outcome"] == "finished"
    assert result["line_rms_mm"] < 0.1
    assert result["contact_fraction"] > 0.995
    assert result["force_rms_error_n"] < 0.1
    alone = run_lockstep(load_scenario(tmp_path / "fragment.toml"), 3)
    assert result["line_rms_mm"] == pytest.approx(alone.result["line_rms_mm"], rel=1e-6)
    assert (tmp_path / "out" / "board.png").stat().st_size > 10_000


@pytest.mark.processes
def test_a_killed_observer_means_safe_hold_and_a_way_to_resume(tmp_path: Path) -> None:
    """kill -9 in mid-program: the arm lets go and says so, the observer returns, resume goes on.

    It is live: on a busy machine the arm may be in a safe hold before, and is told to go on then.
    """
    run_dir = tmp_path / "r"
    command = [sys.executable, "-m", "services.cli", "up", "whiteboard", "--no-console"]
    command += ["--hang", "30", "--run-dir", str(run_dir), "--out", str(tmp_path / "out")]
    up = Command(command, tmp_path / "output")
    try:
        until(lambda: len(list(run_dir.glob("*.sock"))) > len(SERVICES), "all sockets", up.failed)
        with connect(run_dir=run_dir) as robot:
            until(lambda: goes(robot, "running"), "a running program", up.failed)
            killed, pid = robot.latest(ARM_STATUS), robot.latest(HEALTH["observer"]).pid
            os.kill(pid, signal.SIGKILL)
            held = robot.wait_for(
                ARM_STATUS,
                lambda s: s.t > killed.t and s.state == "safe_hold" and "estimate" in s.reason,
                PATIENCE,
            )
            back = robot.wait_for(HEALTH["observer"], lambda h: h.pid != pid and h.t > 0, PATIENCE)
            assert held.t < back.t  # by its absence, not by a stall of this machine later on
            assert "resume or stop" in held.reason
            until(
                lambda: goes(robot, "resuming", "running", "finished"), "a way to go on", up.failed
            )
    finally:
        up.end(signal.SIGKILL)  # nobody looks at its pictures


def goes(robot: Connection, *states: str) -> bool:
    """Whether the arm is in one of these states; if it is in a safe hold it is told to resume."""
    with suppress(Silent, NoAnswer, Refused):
        if robot.latest(ARM_STATUS).state == "safe_hold":
            robot.request("arm", "resume")
        return bool(robot.wait_for(ARM_STATUS, lambda status: status.state in states, 1.0))
    return False


def test_a_push_in_mid_stroke_leaves_the_line_within_5_mm() -> None:
    """200 N for 0.2 s on the platform: the pen stays near the line, within all limits."""
    done = run_lockstep(load_scenario("whiteboard_push"), 2, duration=14.0)
    assert any(x.disturbances for x in done.log.series(TRUTH))
    assert done.result["line_max_mm"] < 5.0
    assert not any(s.state == "protective_stop" for s in done.log.series(ARM_STATUS))
    torque = np.abs([c.tau for c in done.log.series(ARM_COMMAND)]).max(axis=0)
    assert (torque < load_robot("xr4000_puma560").arm.torque_limit).all()


def test_an_arm_that_has_finished_bears_with_a_platform_that_goes_on() -> None:
    """Ten seconds of sway after the end: no limit is left and the board is not touched."""
    done = run_lockstep(load_scenario("whiteboard_moving"), 1, after=10.0)
    states = [s.state for s in done.log.series(ARM_STATUS)]
    assert done.result["outcome"] == "finished"
    after = states[states.index("finished") :]
    assert len(after) > 400
    assert set(after) == {"finished"}
    end = done.log.series(TRUTH)[-1].t
    assert max(x.force for x in done.log.series(TRUTH) if x.t > end - 10.0) == 0.0
