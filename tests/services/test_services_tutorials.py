"""The tutorials work as printed, block by block.

Of a fenced block ``sh`` is run, ``python`` without a title is run, and a title is the name of the
file to write, but for two: ``first terminal`` is what the shared robot was started with, and
``in a fresh clone`` builds an environment, which is what runs this test.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from live_robot import COMMAND, ROOT, environment
from patience import PATIENCE, Command

TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
SAYS = {
    "first_run": r"contour error[\s\S]*run\.mcap[\s\S]*observer[\s\S]*whiteboard_moving\.hds",
    "first_disturbance": r"push[\s\S]*accepted[\s\S]*refused[\s\S]*odometry silent[\s\S]*goes on",
    "read_the_observer": r"heading[\s\S]*10\d\d estimates[\s\S]*mean NIS",
    "first_program": r"no findings[\s\S]*Whiteboard_line[\s\S]*finished",
    "own_robot": r"finished",
}
"""What must be among a tutorial's output, in order."""


def script(text: str) -> str:
    """All blocks as one shell script that stops at the first failure."""
    lines = ["set -euo pipefail"]
    for number, (kind, title, body) in enumerate(
        re.findall(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', text, re.M | re.S)
    ):
        if title == "first terminal":
            assert body.strip() == COMMAND
        elif title == "in a fresh clone":
            assert body.strip() in ("make demo", "make setup")
        elif title or kind == "python":
            name = title or f"block{number}.py"
            lines += [f"cat > {name} <<'END_OF_FILE'", body + "END_OF_FILE"]
            lines += [] if title else [f"python {name}"]
        else:
            assert kind == "sh", f"a block of {kind!r} that is neither run nor a file"
            lines.append(body)
    return "\n".join(lines)


def follow(page: Path, home: Path, folder: Path) -> str:
    """What a tutorial's commands print."""
    env = {**environment(home), "COLUMNS": "100", **_source(folder)}
    shell = Command(["bash", "-c", script(page.read_text())], folder / "said", env=env, cwd=folder)
    code = shell.wait(3 * PATIENCE)
    assert code == 0, shell.said()
    return shell.said()


def _source(folder: Path) -> dict[str, str]:
    """The source as a tutorial may change it: a clone, if it is one."""
    return {"PYTHONPATH": str(folder)} if (folder / "deploy").exists() else {}


def test_every_tutorial_is_tested() -> None:
    """A new page needs its line in ``SAYS``; the site's contents lists them in order."""
    assert {page.stem for page in TUTORIALS} == set(SAYS)
    listed = re.findall(r"tutorials/(\w+)\.md", (ROOT / "mkdocs.yml").read_text())
    assert sorted(listed) == sorted(SAYS)


@pytest.mark.processes
@pytest.mark.parametrize(
    "page", [p for p in TUTORIALS if p.stem != "own_robot"], ids=lambda p: p.stem
)
def test_a_tutorial_runs(page: Path, robot_home: Path, tmp_path: Path) -> None:
    """Every command of it succeeds, and it shows what it says it shows."""
    out = follow(page, robot_home, tmp_path)
    assert re.search(SAYS[page.stem], out), out


def test_the_tutorial_about_robots_runs(tmp_path: Path) -> None:
    """In a clone of the source, to which it adds a robot that then draws."""
    for room in ("arm", "base", "deploy", "observer", "services", "sim"):
        shutil.copytree(ROOT / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
    page = ROOT / "docs" / "tutorials" / "own_robot.md"
    out = follow(page, tmp_path, tmp_path)
    assert re.search(SAYS["own_robot"], out), out
