"""The whole process chain: real services, real processes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from services.run import run_lockstep
from sim.scenario import load_scenario

PATIENCE = 300.0  # [s]; a slow machine may take its time
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
    command = [sys.executable, "-m", "services.cli", "up", str(scenario), "--json", *options]
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
