"""One running robot for all tests that talk to one as a person or a script would."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from patience import PATIENCE, Command, until

from services.script import NotRunning, Silent, connect

ROOT = Path(__file__).parents[2]
COMMAND = "steadyhand up whiteboard_moving"
"""What a person would type; paced, the same happens however busy the machine is."""
LONGEST = 3600
"""Of robot time [s]: it is ended when it is no longer used, and killed with the test run."""


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
    more = ["--no-console", "--paced", "--for", str(LONGEST), "--hang", "30"]
    command = [*COMMAND.split(), *more, "--out", str(home / "run")]
    up = Command(command, home / "output", env=environment(home), cwd=home)
    try:
        until(lambda: _speaks(home / "steadyhand" / "r1"), "arm and platform", up.failed)
        yield home
        assert not up.failed(), f"it ended while it was used: {up.failed()}"
    finally:
        up.end(signal.SIGKILL)  # nobody reads its report


def begin_anew(home: Path) -> None:
    """Have the arm start its task from the beginning, out of whatever state it is in.

    An arm that was idle while the platform swayed may be so near to the end of a joint's range
    that the sway takes it there; it is reset then, as a person would, and started again.
    """
    with connect(run_dir=home / "steadyhand" / "r1") as robot:
        for _ in range(5):
            status = robot.latest("arm/status", PATIENCE)
            if status.state == "protective_stop":
                robot.request("arm", "reset")
            elif status.state not in ("idle", "finished"):
                robot.request("arm", "stop")
            robot.request("arm", "start")
            since = robot.latest("arm/status", PATIENCE).t
            state = robot.wait_for(
                "arm/status", lambda s, since=since: s.t > since + 1.0, PATIENCE
            ).state
            if state == "running":
                return
        raise AssertionError(f"the arm does not begin: it is {state}")


def _speaks(run_dir: Path) -> bool:
    """Whether the arm has begun its task by itself, and the platform is there."""
    try:
        with connect(run_dir=run_dir) as robot:
            robot.wait_for("arm/status", lambda status: status.state != "idle", timeout=10.0)
            robot.latest("base/status")
    except (NotRunning, Silent):
        return False
    return True
