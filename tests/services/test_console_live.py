"""The console's process beside a running robot: before it, after it, without it."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import orjson
import pytest
from patience import PATIENCE, Command, until

from services.logs.file import records
from services.topics import CONSOLE, HEALTH

pytestmark = pytest.mark.processes


class Started:
    """Commands that are ended with the test."""

    def __init__(self, home: Path) -> None:
        self.home, self.run_dir = home, home / "r"
        self._all: list[Command] = []

    def __call__(self, name: str, *args: str) -> Command:
        """Start a command."""
        command = [sys.executable, "-m", "services.cli", *args, "--run-dir", str(self.run_dir)]
        self._all.append(Command(command, self.home / name))
        return self._all[-1]

    def up(self, name: str, *args: str) -> Command:
        """Start a robot that does not stand still when the machine does."""
        out = str(self.home / name)
        more = ("--paced", "--hang", "30", "--out", out)
        return self(f"{name}.txt", "up", "whiteboard", *more, *args)

    def end(self) -> None:
        """End the newest one."""
        self._all.pop().end()

    def end_all(self) -> None:
        """End whatever still runs; nobody reads what it writes then."""
        while self._all:
            self._all.pop().end(signal.SIGKILL)


def says(command: Command, pattern: str) -> re.Match[str]:
    """Wait until a command says what it has to, and look at once when it ends before."""
    return until(lambda: re.search(pattern, command.said()), pattern, command.failed)  # type: ignore[return-value]


@pytest.fixture
def start() -> Iterator[Started]:
    """In a short path, for sockets are in it."""
    with TemporaryDirectory(prefix="sh", ignore_cleanup_errors=True) as home:
        started = Started(Path(home))
        try:
            yield started
        finally:
            started.end_all()


def test_a_console_that_was_there_first_shows_the_robot_and_its_restart(start: Started) -> None:
    """It waits, draws when the robot comes, and goes on with the next robot."""
    alone = start("console", "console", "--port", "0")
    says(alone, r"the page is http://127\.0\.0\.1:")
    for run in ("1", "2"):
        says(start.up(run, "--no-console"), r"arm +running")
        log = start.home / run / "run.mcap"
        until(lambda log=log: hears(log), "a console that hears the robot", alone.failed)  # type: ignore[misc]
        start.end()
    assert "Traceback" not in alone.said()


def hears(log: Path) -> bool:
    """Whether the recorder has written that the console serves its page and hears the robot."""
    found = (record for record in records(log, [HEALTH[CONSOLE].name]) if record.data)
    beats = [orjson.loads(record.data) for record in found]
    return any(beat["t"] > 0.0 and beat["state"] == "serving" for beat in beats)


def test_up_goes_on_without_its_console(start: Started) -> None:
    """A port in use: it is said with what to do, and the robot works."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        up = start.up("out", "--port", port)
        says(up, "given up")
        assert re.search(rf"port {port} .*not free.*--port \(0 for any", up.said())
        says(up, r"arm +running")


def test_a_console_that_dies_comes_back(start: Started) -> None:
    """Killed, it is started again, and the robot has noticed nothing."""
    up = start.up("out", "--port", "0")
    says(up, r"console +ready")
    os.kill(int(says(up, r"console +started +process (\d+)")[1]), signal.SIGKILL)
    says(up, r"console +restarted")
    says(up, r"arm +running")
    assert not re.search(r"(sim|observer|arm|base|recorder) +died", up.said())


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
