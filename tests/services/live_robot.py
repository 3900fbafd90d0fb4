"""One running robot for all tests that talk to one as a person or a script would."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from services.script import NotRunning, Silent, connect

ROOT = Path(__file__).parents[2]
COMMAND = "steadyhand up whiteboard_moving"
"""What a person would type; paced, the same happens however busy the machine is."""
LONGEST = 600
"""Of robot time, so that nothing is left running for ever should a test run be killed [s]."""
PATIENCE = 600.0
"""For what happens in seconds on a quiet machine [s]."""


def environment(home: Path) -> dict[str, str]:
    """Of a shell in which ``python`` and the default run directory are those of the tests."""
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    (home / "bin").mkdir(exist_ok=True)
    for name, module in (("python", ""), ("steadyhand", "-m services.cli")):
        script = home / "bin" / name
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" {module} "$@"\n')
        script.chmod(0o755)
    return {
        **os.environ,
        "PATH": f"{home / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": path,
        "XDG_RUNTIME_DIR": str(home),
    }


@contextmanager
def running(home: Path) -> Iterator[Path]:
    """``COMMAND``, paced, with its sockets below ``home``, until the ``with`` is left."""
    log = home / "output"
    command = [
        *COMMAND.split(),
        "--no-console",
        "--paced",
        "--for",
        str(LONGEST),
        "--out",
        str(home / "run"),
    ]
    with log.open("w") as file:
        up = subprocess.Popen(command, stdout=file, stderr=file, env=environment(home), cwd=home)
    try:
        deadline = time.monotonic() + PATIENCE
        while not _speaks(home / "steadyhand" / "r1"):
            assert up.poll() is None and time.monotonic() < deadline, log.read_text()
        yield home
        assert up.poll() is None, f"it ended while it was used: {log.read_text()}"
    finally:
        up.terminate()
        try:
            up.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            up.kill()


def _speaks(run_dir: Path) -> bool:
    """Whether the arm and the platform are at work."""
    try:
        with connect(run_dir=run_dir) as robot:
            robot.wait_for("arm/status", lambda status: status.state == "running", timeout=1.0)
            robot.latest("base/status", timeout=1.0)
    except (NotRunning, Silent):
        time.sleep(0.1)
        return False
    return True
