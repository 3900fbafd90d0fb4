"""The console's process beside a running robot: before it, after it, without it."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from services.logs.runlog import read_log
from services.topics import CONSOLE, HEALTH

pytestmark = pytest.mark.processes
PATIENCE = 300.0


def until(seen: Callable[[], object], what: str) -> None:
    """Wait, as long as it takes on a busy machine."""
    deadline = time.monotonic() + PATIENCE
    while not seen():
        assert time.monotonic() < deadline, f"not seen: {what}"
        time.sleep(0.1)


class Started:
    """Commands that are ended with the test; their output is in files."""

    def __init__(self, home: Path) -> None:
        self.home, self.run_dir = home, home / "r"
        self._all: list[subprocess.Popen[bytes]] = []

    def __call__(self, name: str, *args: str) -> Callable[[], str]:
        """Start a command; what it has said so far is returned by calling the result."""
        said = self.home / name
        with said.open("wb") as file:
            command = [sys.executable, "-m", "services.cli", *args, "--run-dir", str(self.run_dir)]
            self._all.append(subprocess.Popen(command, stdout=file, stderr=file))
        return said.read_text

    def end(self, number: int = -1) -> None:
        """End the newest one, or that of a number."""
        process = self._all.pop(number)
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)

    def end_all(self) -> None:
        """End whatever still runs."""
        while self._all:
            self.end()


@pytest.fixture
def start() -> Iterator[Started]:
    """In a short path, for sockets are in it."""
    with TemporaryDirectory(prefix="sh") as home:
        started = Started(Path(home))
        try:
            yield started
        finally:
            started.end_all()


def test_a_console_that_was_there_first_shows_the_robot_and_its_restart(start: Started) -> None:
    """It waits, draws when the robot comes, and goes on with the next robot."""
    alone = start("console", "console", "--port", "0")
    until(lambda: "the page is http://127.0.0.1:" in alone(), "the page")
    for run in ("1", "2"):
        out = str(start.home / run)
        robot = start(f"up{run}", "up", "whiteboard", "--no-console", "--paced", "--out", out)
        until(lambda robot=robot: re.search(r"arm +running", robot()), "the arm")  # type: ignore[misc]
        time.sleep(1.0)  # some heartbeats
        start.end()
        log, _ = read_log(start.home / run / "run.mcap", [HEALTH[CONSOLE]])
        beats = log.series(HEALTH[CONSOLE])
        assert beats and beats[-1].t > 0.0, "the console did not hear the robot"
        assert beats[-1].state == "serving"
    assert "Traceback" not in alone()


def test_up_goes_on_without_its_console(start: Started) -> None:
    """A port in use: it is said with what to do, and the robot works."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        out = str(start.home / "out")
        up = start("up", "up", "whiteboard", "--paced", "--port", port, "--out", out)
        until(lambda: "given up" in up(), "the console given up")
        assert re.search(rf"port {port} .*not free.*--port \(0 for any", up())
        until(lambda: re.search(r"arm +running", up()), "a robot that works")


def test_a_console_that_dies_comes_back(start: Started) -> None:
    """Killed, it is started again, and the robot has noticed nothing."""
    out = str(start.home / "out")
    up = start("up", "up", "whiteboard", "--paced", "--port", "0", "--out", out)
    until(lambda: re.search(r"console +ready", up()), "the console")
    found = re.search(r"console +started +process (\d+)", up())
    assert found is not None
    os.kill(int(found[1]), signal.SIGKILL)
    until(lambda: re.search(r"console +restarted", up()), "the console again")
    until(lambda: re.search(r"arm +running", up()), "a robot that works")
    assert not re.search(r"(sim|observer|arm|base|recorder) +died", up())


def test_a_port_in_use_ends_the_command_with_a_way_on(start: Started) -> None:
    """Exit code 1, one line, no traceback."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        done = subprocess.run(
            [sys.executable, "-m", "services.cli", "console", "--port", port],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
    assert done.returncode == 1
    assert "not free" in done.stderr and "Traceback" not in done.stderr
