"""A robot brought up for a measurement, and what else may run beside it."""

from __future__ import annotations

import itertools
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil

from services.live.realtime import cores
from services.messages import AT_WORK
from services.requests import NoAnswer
from services.script import Connection, Refused, Silent, connect
from services.topics import ARM_STATUS, SERVICES

START = 60.0
"""For the robot to come up [s]."""
_BURN = "while True: pass"


@contextmanager
def robot(run_dir: Path, scenario: str, *options: str) -> Iterator[tuple[psutil.Popen, Connection]]:
    """``steadyhand up`` with these options, and a line to it; both are gone afterwards.

    Raises:
        TimeoutError: it did not come up.
    """
    command = [sys.executable, "-m", "services.cli", "up", scenario, "--port", "0"]
    command += ["--run-dir", str(run_dir)]
    run_dir.mkdir(parents=True, exist_ok=True)
    said = run_dir / "up.txt"
    with said.open("w") as out:
        up = psutil.Popen([*command, *options], stdout=out, stderr=subprocess.STDOUT)
        try:
            deadline = time.monotonic() + START
            while len(re.findall(r" ready ", said.read_text())) < len(SERVICES):
                if time.monotonic() > deadline or up.poll() is not None:
                    raise TimeoutError(f"the robot did not come up; see {said}")
                time.sleep(0.1)
            with connect(run_dir=run_dir) as line:
                yield up, line
        finally:
            _end(up)


def to_work(line: Connection, patience: float = START) -> None:
    """Have arm and platform at work, as a person would.

    Raises:
        Silent: they are not, after so long [s].
    """
    deadline = time.monotonic() + patience
    for verb in itertools.cycle(("resume", "reset", "start")):
        if line.latest(ARM_STATUS, START).state in AT_WORK:
            break
        with suppress(Refused, NoAnswer):
            line.request("arm", verb)
        if time.monotonic() > deadline:
            raise Silent(f"the arm is not at work after {patience:g} s")
        time.sleep(0.05)
    with suppress(Refused, NoAnswer):
        line.request("base", "resume")


@contextmanager
def busy_machine(busy: bool) -> Iterator[None]:
    """An ordinary program that never rests on every core, if ``busy``."""
    burning: Sequence[subprocess.Popen[bytes]] = [
        # Ctrl-C is for us, who end them; each would print a traceback
        subprocess.Popen([sys.executable, "-c", _BURN], start_new_session=True)
        for _ in range(cores() if busy else 0)
    ]
    try:
        yield
    finally:
        for process in burning:
            process.kill()
            process.wait()


def _end(up: psutil.Popen) -> None:
    if up.poll() is None:
        for child in up.children(recursive=True):
            with suppress(psutil.NoSuchProcess):
                child.resume()
        up.terminate()
        try:
            up.wait(35.0)
        except psutil.TimeoutExpired:
            up.kill()
