"""The supervisor judges by heartbeats, restarts what fails, and leaves nothing behind."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from services.live.supervisor import backoff
from services.topics import SERVICES

PATIENCE = 60.0


def eventually(condition: Callable[[], bool]) -> None:
    """Wait generously for something that has to happen."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.02)


class Up:
    """``steadyhand up`` with toy services, and what it prints."""

    def __init__(self, run_dir: Path, *options: str) -> None:
        self.run_dir = run_dir
        self.output = run_dir.parent / "output"
        self.errors = run_dir.parent / "errors"
        command = [sys.executable, "-m", "services.cli", "up", "toys", "--run-dir", str(run_dir)]
        command += ["--factory", "service_toys:build", "--rt", "off", "--hang", "5", *options]
        with self.output.open("w") as output, self.errors.open("w") as errors:
            self.process = subprocess.Popen(command, stdout=output, stderr=errors)

    def events(self, kind: str) -> list[str]:
        """The services of all events of a kind, in order."""
        lines = [line.split() for line in self.output.read_text().splitlines()]
        return [words[1] for words in lines if len(words) > 2 and words[2] == kind]

    def children(self) -> dict[str, psutil.Process]:
        """Running services by name."""
        out = {}
        for child in psutil.Process(self.process.pid).children():
            arguments = child.cmdline()
            if "--service" in arguments and "--spare" not in arguments:
                out[arguments[arguments.index("--service") + 1]] = child
        return out

    def wait_ready(self) -> dict[str, psutil.Process]:
        """Wait until all four services are ready."""
        eventually(lambda: len(self.events("ready")) == 4 or self.process.poll() is not None)
        assert self.process.poll() is None, self.errors.read_text()
        return self.children()


@pytest.fixture
def run_dir(tmp_path: Path) -> Iterator[Path]:
    """A short name: unix sockets are made in it."""
    yield tmp_path / "r"
    for process in psutil.process_iter(["cmdline"]):
        if any(str(tmp_path) in part for part in process.info["cmdline"] or []):
            process.kill()


def _gone(processes: dict[str, psutil.Process]) -> bool:
    return not any(p.is_running() and p.status() != "zombie" for p in processes.values())


@pytest.mark.processes
def test_killed_services_come_back_and_the_end_is_clean(run_dir: Path) -> None:
    """Any one killed, the first included, is restarted alone; Ctrl-C leaves no process."""
    up = Up(run_dir)
    children = up.wait_ready()
    assert up.events("ready") == list(SERVICES)
    for number, name in enumerate(("sim", "arm", "observer", "base"), 1):
        children[name].kill()
        eventually(lambda n=number: len(up.events("restarted")) == n)  # type: ignore[misc]
    assert up.events("restarted") == ["sim", "arm", "observer", "base"]
    after = up.children()
    assert all(after[name].pid != children[name].pid for name in children)
    assert "--restarted" in after["arm"].cmdline()
    up.process.send_signal(signal.SIGINT)
    assert up.process.wait(PATIENCE) == 0
    assert _gone(after)


@pytest.mark.processes
def test_a_spare_takes_over(run_dir: Path) -> None:
    """While all is calm processes get ready; one takes the place of what died, and is replaced."""
    up = Up(run_dir, "--hang", "30")
    children = up.wait_ready()
    eventually(lambda: len(list(run_dir.glob("*.ready"))) == len(SERVICES))
    children["observer"].kill()
    eventually(lambda: "observer" in up.events("restarted"))
    assert up.output.read_text().count("a spare") == 1
    assert up.children().keys() >= children.keys() - {"observer"}
    family = psutil.Process(up.process.pid).children(recursive=True)
    up.process.send_signal(signal.SIGINT)
    assert up.process.wait(PATIENCE) == 0
    assert _gone({str(p.pid): p for p in family})


@pytest.mark.processes
def test_a_hung_service_is_killed_and_restarted(run_dir: Path) -> None:
    """A stopped process is there, but makes no progress: that counts as dead."""
    up = Up(run_dir, "--hang", "2")
    up.wait_ready()["observer"].suspend()
    eventually(lambda: "observer" in up.events("restarted"))
    assert up.events("hung")[0] == "observer"
    took = re.search(r"observer +restarted +in ([\d.]+) s", up.output.read_text())
    assert took and float(took[1]) < PATIENCE
    up.process.terminate()
    assert up.process.wait(PATIENCE) == 0


@pytest.mark.processes
def test_services_do_not_outlive_the_supervisor(run_dir: Path) -> None:
    """A killed supervisor takes its services along, even a stopped one."""
    up = Up(run_dir)
    children = up.wait_ready()
    children["base"].suspend()
    up.process.kill()
    up.process.wait(PATIENCE)
    eventually(lambda: _gone(children))


@pytest.mark.processes
def test_one_supervisor_per_robot(run_dir: Path) -> None:
    """A second one is refused and told who has the robot; the first goes on."""
    up = Up(run_dir)
    up.wait_ready()
    again = subprocess.run(
        [sys.executable, "-m", "services.cli", "up", "toys", "--run-dir", str(run_dir),
         "--factory", "service_toys:build"],
        capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert again.returncode == 1
    assert str(up.process.pid) in again.stderr
    assert len(up.children()) == 4
    up.process.terminate()
    assert up.process.wait(PATIENCE) == 0


@pytest.mark.processes
def test_a_service_that_cannot_start_ends_it_with_its_log(run_dir: Path) -> None:
    """Exit code 1, and the reason from the log, not only that it failed."""
    up = Up(run_dir, "--factory", "no_such_module:build")
    assert up.process.wait(PATIENCE) == 1
    assert "no_such_module" in up.errors.read_text()


@pytest.mark.processes
def test_paced_processes_end_by_themselves(run_dir: Path) -> None:
    """A paced run of real processes ends after its robot time, with exit code 0."""
    up = Up(run_dir, "--paced", "--for", "0.5", "--json")
    assert up.process.wait(PATIENCE * 2) == 0, up.errors.read_text()
    result = json.loads(up.output.read_text())
    assert result["success"]
    ended = [event["service"] for event in result["events"] if event["kind"] == "ended"]
    assert set(ended) >= {"sim", "observer", "base", "arm"}


@pytest.mark.processes
def test_a_paced_run_that_loses_a_service_fails(run_dir: Path) -> None:
    """What is lost in a paced run cannot be regained; exit code 1, nothing left."""
    up = Up(run_dir, "--paced")
    children = up.wait_ready()
    os.kill(children["base"].pid, signal.SIGKILL)
    assert up.process.wait(PATIENCE) == 1
    assert _gone(children)


def test_backoff_grows_and_ends_growing() -> None:
    """The first restart is at once; later ones wait longer, up to a limit."""
    waits = [backoff(n) for n in range(1, 12)]
    assert waits[0] == 0.0
    assert waits == sorted(waits)
    assert waits[-1] == 8.0
