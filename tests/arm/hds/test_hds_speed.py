"""Checking a program from the shell takes no longer than a person notices."""

import resource
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
NODE = """
BEGIN
    NAME = N%d;
    TYPE = Whiteboard_line;
    Length = 50; Direction = 225; Speed = 40; Force = 150;
    TRANSITION[Finished] = %s;
    TRANSITION[Force > 5 N] = End;
END
"""


@pytest.fixture
def fifty(tmp_path: Path) -> Path:
    """A program of 50 nodes."""
    nodes = [NODE % (i, f"N{i + 1}" if i < 49 else "End") for i in range(50)]
    file = tmp_path / "fifty.hds"
    file.write_text("INTERFACE = r1;\nINITIAL = N0;\n" + "".join(nodes))
    return file


def command(*options: str) -> list[str]:
    """A check as the shell runs it."""
    return [sys.executable, *options, "-m", "services.cli", "program", "check"]


def best_of_five(arguments: list[str]) -> tuple[float, str]:
    """Best time by the clock or, as others may use the machine, of the processor; last output."""
    times, output = [], ""
    for _ in range(5):
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, timeout=60)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert done.returncode == 0, done.stderr
        output = done.stdout
        times.append(time.perf_counter() - began)
        times.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    return min(times), output


def test_fifty_nodes_are_checked_from_the_shell_in_half_a_second(fifty: Path) -> None:
    """Or, where the machine is slow, in thrice what starting Python with numpy takes."""
    bare, _ = best_of_five([sys.executable, "-c", "import numpy, typer, lark"])
    taken, output = best_of_five([*command(), str(fifty)])
    assert "no findings" in output
    assert taken <= max(0.5, 3.0 * bare), (taken, bare)


def test_a_check_imports_no_simulator_and_no_bus(fifty: Path) -> None:
    """What only a robot or a simulation needs stays out."""
    done = subprocess.run(
        [*command("-X", "importtime"), str(fifty)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "arm.hds.check" in imported
    assert not imported & {
        "dartpy",
        "scipy",
        "zenoh",
        "circus",
        "matplotlib",
        "services.live.supervisor",
    }
