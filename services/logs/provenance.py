"""Where a log comes from: code, scenario, robot, programs, seed, versions."""

from __future__ import annotations

import hashlib
import platform
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from pathlib import Path

from deploy.robot import ROBOTS
from deploy.task import BASE_PROGRAMS, PROGRAMS, find_program
from deploy.tomlfile import BadFile
from sim.scenario import Scenario, load_scenario

ROOT = Path(__file__).parents[2]
PACKAGES = (
    "steadyhand",
    "numpy",
    "scipy",
    "dartpy",
    "filterpy",
    "pydantic",
    "eclipse-zenoh",
    "mcap",
)


def provenance(
    scenario: Scenario, seed: int, observer: str, mode: str = "lockstep"
) -> dict[str, str]:
    """What a log must say about where it came from; words only.

    Args:
        scenario: that is run.
        seed: of it.
        observer: kind of observer.
        mode: lockstep, paced or live.
    """
    text = scenario.path.read_text(encoding="utf-8") if scenario.path.is_file() else ""
    robot = ROBOTS / scenario.robot / "robot.toml"
    return {
        "scenario": scenario.name,
        "scenario_sha256": hashlib.sha256(text.encode()).hexdigest(),
        "scenario_toml": text,
        "robot": scenario.robot,
        "robot_toml": robot.read_text(encoding="utf-8") if robot.is_file() else "",
        **_programs(scenario),
        "record": scenario.record,
        "seed": str(seed),
        "observer": observer,
        "mode": mode,
        "git": git_hash(),
        "python": platform.python_version(),
    } | {name: metadata.version(name) for name in PACKAGES}


def _programs(scenario: Scenario) -> dict[str, str]:
    """Text of the programs that the scenario names, as ``program <name>``."""
    out = {}
    for name, folder in _named(scenario):
        try:
            path = find_program(name, scenario.path.parent, (folder,))
        except BadFile:
            continue  # whoever is to run it says so
        out[f"program {name}"] = path.read_text(encoding="utf-8", errors="replace")
    return out


def _named(scenario: Scenario) -> list[tuple[str, Path]]:
    """Programs that a scenario names, and the folder in which such programs are."""
    task = scenario.task
    both = ((task.program, PROGRAMS), (task.base.program, BASE_PROGRAMS))
    return [(name, folder) for name, folder in both if name]


@cache  # the code that a process runs does not change while it lives
def git_hash() -> str:
    """The commit this code is of, ``-dirty`` if files differ from it; ``unknown`` outside git."""
    if not (ROOT / ".git").exists():
        return "unknown"
    command = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--abbrev=40", "--match="]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10)
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return done.stdout.strip() or "unknown"


@contextmanager
def scenario_of(about: Mapping[str, str]) -> Iterator[Scenario]:
    """The scenario that a log was made with, from the log alone; its programs as they were then.

    Its files are gone at the end of the ``with``.

    Args:
        about: metadata of the log.

    Raises:
        BadFile: the log has no scenario, or one that today's code does not read.
    """
    name = about.get("scenario") or "scenario"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{Path(name).name}.toml"
        if not about.get("scenario_toml"):
            raise BadFile(path, ["the log does not say which scenario it is of"])
        path.write_text(about["scenario_toml"], encoding="utf-8")
        scenario = load_scenario(path)
        now = _programs(scenario)
        for program, _ in _named(scenario):
            text = about.get(f"program {program}", "")
            beside = Path(folder) / program
            if text and text != now.get(f"program {program}") and beside.is_relative_to(folder):
                beside.parent.mkdir(parents=True, exist_ok=True)
                beside.write_text(text, encoding="utf-8")
        yield scenario
