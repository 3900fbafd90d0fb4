"""The numbered examples do what their first line says, on a running robot."""

from __future__ import annotations

import csv
import re
import subprocess
import sys
from pathlib import Path

import pytest
from live_robot import COMMAND, ROOT, environment
from patience import PATIENCE

EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))


def run(name: str, home: Path, folder: Path) -> str:
    """What an example prints; it must end by itself and well."""
    (file,) = (e for e in EXAMPLES if e.name.startswith(name))
    done = subprocess.run(
        [sys.executable, str(file)], cwd=folder, env=environment(home),
        capture_output=True, text=True, timeout=2 * PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_they_are_numbered_and_say_what_must_run() -> None:
    """1, 2, 3 ... without a gap, each with the command that starts what it talks to."""
    assert [int(e.name[:2]) for e in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))
    for example in EXAMPLES:
        assert f"First, in another terminal: {COMMAND}\n" in example.read_text(), example


@pytest.mark.processes
def test_01_reads_every_estimate(robot_home: Path, tmp_path: Path) -> None:
    """A second of them, none missed, and the platform moves in it."""
    out = run("01", robot_home, tmp_path)
    count, missed = map(int, re.findall(r"^(\d+) estimates, (\d+) missed", out, re.M)[0])
    assert count in (500, 501, 502) and missed == 0
    places = [tuple(map(float, p)) for p in re.findall(r"x +([-+.\d]+) mm  y +([-+.\d]+)", out)]
    assert len(places) >= 5 and len(set(places)) > 1


@pytest.mark.processes
def test_02_the_observer_feels_a_push(robot_home: Path, tmp_path: Path) -> None:
    """It sees an acceleration that swaying does not give, and a push too hard is refused."""
    out = run("02", robot_home, tmp_path)
    (acceleration,) = re.findall(r"up to ([.\d]+) m/s\^2", out)
    assert float(acceleration) > 0.8  # swaying takes 0.3 at most
    assert "disturbed" in out and "refused disturb" in out


@pytest.mark.processes
def test_03_a_program_runs_to_its_end(robot_home: Path, tmp_path: Path) -> None:
    """Every node of it, in order, the stroke included."""
    out = run("03", robot_home, tmp_path)
    ways = re.findall(r"arm +(\w+) +(\w+ -> \w+)$", out, re.M)
    assert ways[-4:] == [
        ("Finished", "Above -> Touch"),
        ("Contact", "Touch -> Stroke"),
        ("Finished", "Stroke -> Away"),
        ("Finished", "Away -> End"),
    ]


@pytest.mark.processes
def test_04_the_arm_lets_go_and_goes_on(robot_home: Path, tmp_path: Path) -> None:
    """Without odometry it comes to a safe hold, and once it is back it draws on when told to."""
    out = run("04", robot_home, tmp_path)
    assert re.search(r"the arm let go: .*odometry silent", out)
    assert "the arm goes on" in out


@pytest.mark.processes
def test_05_writes_a_table(robot_home: Path, tmp_path: Path) -> None:
    """A row for every status of a second, at 50 a second."""
    run("05", robot_home, tmp_path)
    with (tmp_path / "force.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert 50 <= len(rows) <= 60
    assert all(float(row["joint_margin_rad"]) > 0 for row in rows)
