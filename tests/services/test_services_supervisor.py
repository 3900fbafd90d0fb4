"""The supervisor judges by heartbeats, restarts what fails, and leaves nothing behind."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from patience import PATIENCE, Command, until
from typer.testing import CliRunner

from services.cli.main import app
from services.live.supervisor import backoff
from services.topics import SERVICES


class Up(Command):
    """``steadyhand up`` with toy services, and what it prints."""

    def __init__(self, run_dir: Path, *options: str) -> None:
        command = [sys.executable, "-m", "services.cli", "up", "toys", "--run-dir", str(run_dir)]
        command += ["--factory", "service_toys:build", "--rt", "off", "--hang", "30", *options]
        super().__init__(command, run_dir.parent / "output", run_dir.parent / "errors")

    def events(self, kind: str) -> list[str]:
        """The services of all events of a kind, in order."""
        lines = [line.split() for line in self.said().splitlines()]
        return [words[1] for words in lines if len(words) > 2 and words[2] == kind]

    def wait_for(self, kind: str, *services: str) -> None:
        """Wait until each of these services had such an event."""
        until(lambda: set(services) <= set(self.events(kind)), f"{services} {kind}", self.failed)

    def children(self) -> dict[str, psutil.Process]:
        """Running services by name; a spare where there is nothing else."""
        out = {}
        for child in psutil.Process(self.process.pid).children():
            arguments = child.cmdline()
            if "--service" in arguments:
                name = arguments[arguments.index("--service") + 1]
                out[name] = out.get(name, child) if "--spare" in arguments else child
        return out

    def wait_ready(self) -> dict[str, psutil.Process]:
        """Wait until all four services are ready."""
        self.wait_for("ready", *SERVICES)
        return self.children()


@pytest.fixture
def run_dir(tmp_path: Path) -> Iterator[Path]:
    """A short name: unix sockets are made in it."""
    yield tmp_path / "r"
    for process in psutil.process_iter(["cmdline"]):
        if any(str(tmp_path) in part for part in process.info["cmdline"] or []):
            process.kill()


def _gone(processes: dict[str, psutil.Process]) -> bool:
    return not any(_runs(process) for process in processes.values())


def _runs(process: psutil.Process) -> bool:
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@pytest.mark.processes
def test_killed_services_come_back_and_the_end_is_clean(run_dir: Path) -> None:
    """Any one killed, the first included, is restarted alone; Ctrl-C leaves no process.

    How often is in the heartbeats, for ``steadyhand watch``.
    """
    up = Up(run_dir)
    children = up.wait_ready()
    assert up.events("ready") == list(SERVICES)
    for name in ("sim", "arm", "observer", "base"):
        children[name].kill()
        up.wait_for("restarted", name)
    assert up.events("restarted") == ["sim", "arm", "observer", "base"]
    after = up.children()
    assert all(after[name].pid != children[name].pid for name in children)
    assert "--restarted" in after["arm"].cmdline()
    after["arm"].kill()
    until(lambda: up.events("restarted").count("arm") == 2, "arm again", up.failed)
    after = up.children()
    shown = CliRunner().invoke(app, ["watch", "--once", "--json", "--run-dir", str(run_dir)])
    restarts = {h["service"]: h["restarts"] for h in json.loads(shown.output).values()}
    assert restarts == {"sim": 1, "observer": 1, "arm": 2, "base": 1}
    assert up.end() == 0
    assert _gone(after)


@pytest.mark.processes
def test_a_spare_takes_over(run_dir: Path) -> None:
    """While all is calm processes get ready; one takes the place of what died, and is replaced."""
    up = Up(run_dir)
    children = up.wait_ready()
    until(lambda: len(list(run_dir.glob("*.ready"))) == len(SERVICES), "spares", up.failed)
    children["observer"].kill()
    up.wait_for("restarted", "observer")
    assert re.search(r"observer +started +process \d+, a spare", up.said())
    assert up.children().keys() == children.keys()
    family = psutil.Process(up.process.pid).children(recursive=True)
    assert up.end() == 0
    assert _gone({str(p.pid): p for p in family})


@pytest.mark.processes
def test_a_hung_service_is_killed_and_restarted(run_dir: Path) -> None:
    """A stopped process is there, but its loop stands still: that counts as dead, soon."""
    up = Up(run_dir, "--hang", "0.4")
    observer = up.wait_ready()["observer"]
    observer.suspend()
    up.wait_for("restarted", "observer")
    assert "its loop stood still for 0.4 s" in up.said()
    took = re.search(r"observer +restarted +in ([\d.]+) s", up.said())
    assert took and float(took[1]) < PATIENCE
    assert not _runs(observer)
    assert up.end(signal.SIGTERM) == 0


@pytest.mark.processes
def test_a_service_that_holds_the_interpreters_lock_is_replaced(run_dir: Path) -> None:
    """None of its threads can say so, nor end it; the others go on undisturbed."""
    up = Up(run_dir, "--hang", "0.4", "--factory", "service_toys:build_lockable")
    before = up.wait_ready()
    before["observer"].send_signal(signal.SIGUSR2)
    up.wait_for("restarted", "observer")
    assert "observer" in up.events("hung")
    assert not _runs(before["observer"])
    after = up.children()
    assert after["observer"].pid != before["observer"].pid
    assert {name for name in before if after[name] == before[name]} == {"sim", "base", "arm"}
    assert up.end() == 0


@pytest.mark.processes
def test_a_robot_of_ones_own_is_heard_and_judged_but_neither_started_nor_ended(
    run_dir: Path,
) -> None:
    """``--without sim``: waited for as long as it takes, called hung, left alone, taken back."""

    def robot(number: int) -> Command:
        command = [sys.executable, "-m", "services.live.process", "--service", "sim"]
        command += ["--scenario", "toys", "--factory", "service_toys:build", "--rt", "off"]
        return Command([*command, "--run-dir", str(run_dir)], run_dir.parent / f"robot{number}")

    up = Up(run_dir, "--without", "sim")
    up.wait_for("ready", "observer", "arm", "base")
    up.wait_for("waiting", "sim")
    assert up.children().keys() == {"observer", "arm", "base"}
    first = robot(1)
    up.wait_for("ready", "sim")
    psutil.Process(first.process.pid).suspend()
    up.wait_for("hung", "sim")
    assert first.process.poll() is None
    first.process.kill()
    second = robot(2)
    up.wait_for("restarted", "sim")
    assert up.events("started").count("sim") == 0
    assert up.end() == 0
    assert second.process.poll() is None
    second.end()


@pytest.mark.parametrize("wrong", [["arm"], ["sim", "--paced"]])
def test_nothing_but_the_live_robot_can_be_brought(wrong: list[str]) -> None:
    """Whoever leaves out anything else is told what can be."""
    done = CliRunner().invoke(app, ["up", "whiteboard", "--without", *wrong])
    assert done.exit_code == 2
    assert "only sim" in done.stderr


@pytest.mark.processes
def test_services_do_not_outlive_the_supervisor(run_dir: Path) -> None:
    """A killed supervisor takes its services along, even a stopped one."""
    up = Up(run_dir)
    children = up.wait_ready()
    children["base"].suspend()
    up.process.kill()
    up.wait()
    until(lambda: _gone(children), "the end of its services")


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
    assert up.end(signal.SIGTERM) == 0


@pytest.mark.processes
def test_a_service_that_cannot_start_ends_it_with_its_log(run_dir: Path) -> None:
    """Exit code 1, and the reason from the log, not only that it failed."""
    up = Up(run_dir, "--factory", "no_such_module:build")
    assert up.wait() == 1
    assert "no_such_module" in up.errors.read_text()


@pytest.mark.processes
def test_paced_processes_end_by_themselves(run_dir: Path) -> None:
    """A paced run of real processes ends after its robot time, with exit code 0."""
    up = Up(run_dir, "--paced", "--for", "0.5", "--json")
    assert up.wait() == 0, up.errors.read_text()
    result = json.loads(up.said())
    assert result["success"]
    ended = [event["service"] for event in result["events"] if event["kind"] == "ended"]
    assert set(ended) >= {"sim", "observer", "base", "arm"}


@pytest.mark.processes
def test_a_paced_run_that_loses_a_service_fails(run_dir: Path) -> None:
    """What is lost in a paced run cannot be regained; exit code 1, nothing left."""
    up = Up(run_dir, "--paced")
    children = up.wait_ready()
    os.kill(children["base"].pid, signal.SIGKILL)
    assert up.wait() == 1
    assert _gone(children)


def test_backoff_grows_and_ends_growing() -> None:
    """The first restart is at once; later ones wait longer, up to a limit."""
    waits = [backoff(n) for n in range(1, 12)]
    assert waits[0] == 0.0
    assert waits == sorted(waits)
    assert waits[-1] == 8.0
