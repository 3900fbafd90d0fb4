"""Waiting for what happens in seconds on a quiet machine, and commands that end with the tests."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

PATIENCE = 300.0
"""For anything that has to happen, however busy the machine is [s]."""
MORTAL = """
import os, sys
from services.live.realtime import die_with_parent
die_with_parent(int(sys.argv[1]))
os.execvp(sys.argv[2], sys.argv[2:])
"""
"""Becomes the command that follows, and is killed with whoever started it."""

T = TypeVar("T")


def until(
    seen: Callable[[], T],
    what: str,
    failed: Callable[[], str] = str,
    every: float = 0.05,
    patience: float = PATIENCE,
) -> T:
    """What ``seen`` returns once it is true.

    Args:
        seen: asked again and again.
        what: is waited for, in words.
        failed: why there is no point in waiting any longer; empty as long as there is.
        every: how long to wait between [s].
        patience: how long to wait at most [s].

    Raises:
        AssertionError: it was not seen in time, or cannot be any more.
    """
    deadline = time.monotonic() + patience
    while not (found := seen()):
        why = failed()
        assert not why, f"not seen: {what}; {why}"
        assert time.monotonic() < deadline, f"not seen in {patience:g} s: {what}"
        time.sleep(every)
    return found


class Command:
    """A command that is killed with the test run, however that ends; its output is in files.

    Args:
        command: and its arguments.
        output: file for what it says.
        errors: file for its standard error; None for the same.
        env: its environment; None for ours.
        cwd: its directory; None for ours.
    """

    def __init__(
        self,
        command: Sequence[str],
        output: Path,
        errors: Path | None = None,
        env: dict[str, str] | None = None,
        cwd: Path | None = None,
    ) -> None:
        self.output, self.errors = output, errors or output
        argv = [sys.executable, "-c", MORTAL, str(os.getpid()), *command]
        with output.open("wb") as out, (errors or Path(os.devnull)).open("wb") as err:
            other = err if errors else subprocess.STDOUT
            self.process = subprocess.Popen(argv, stdout=out, stderr=other, env=env, cwd=cwd)

    def said(self) -> str:
        """What it has said so far."""
        return self.output.read_text(errors="replace")

    def failed(self) -> str:
        """How it ended and what it said; empty as long as it runs."""
        code = self.process.poll()
        said = self.errors.read_text(errors="replace") if code is not None else ""
        return "" if code is None else f"it ended with {code} and said:\n{said}"

    def wait(self, patience: float = PATIENCE) -> int:
        """Its exit code; if it does not end within ``patience`` [s], it is killed.

        Raises:
            subprocess.TimeoutExpired: it did not.
        """
        try:
            return self.process.wait(patience)
        finally:
            self.process.kill()
            self.process.wait()

    def end(self, number: int = signal.SIGINT) -> int:
        """Ask it to end, as Ctrl-C does; otherwise as ``wait``."""
        self.process.send_signal(number)
        return self.wait()
