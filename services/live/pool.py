"""Processes of this machine behind one small class; circus does the spawning and the logs.

Only circus' ``Watcher`` is used, driven from our own loop: no arbiter, no control socket, no
signal handlers. Traps that are avoided here: ``Watcher.reap_processes`` waits for ever for a
living process, the periodic check collides with starts and stops, and ``close_child_stdin`` needs
a real standard input. A pipe closed between its readiness and its callback makes tornado raise
``KeyError``, or the read fail: nothing is lost by it, and it is not shown.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import shlex
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from circus.watcher import Watcher

LOG_SIZE, LOGS_KEPT = 5_000_000, 3
GRACE = 1.0  # [s] between being asked to end and being killed
PATIENT_GRACE = 30.0  # [s] the same, for the one that may have something to finish

logging.getLogger("circus").setLevel(logging.ERROR)


def _hide_closed_pipes(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Exception handler of the loop: all are shown but tornado's of a pipe just closed."""
    error = context.get("exception")
    closed = isinstance(error, KeyError) or getattr(error, "errno", None) == errno.EBADF
    if not (closed and "_handle_events" in repr(context.get("handle"))):
        loop.default_exception_handler(context)


class Pool:
    """Named processes, each with a rotating log ``<name>.log`` in the run directory.

    Use it inside a running event loop, from the main thread: children are told to die with the
    thread that started them.
    """

    def __init__(self, run_dir: Path) -> None:
        self._run_dir = run_dir
        self._watchers: dict[str, Watcher] = {}

    def log_file(self, name: str) -> Path:
        """Where a process' output goes."""
        return self._run_dir / f"{name}.log"

    async def start(self, name: str, args: Sequence[str], log: str = "") -> int:
        """Start Python with these arguments; returns the process id.

        Args:
            name: of the process.
            args: of the interpreter.
            log: whose log it writes; its own by default.

        Raises:
            OSError: it could not be started.
        """
        asyncio.get_running_loop().set_exception_handler(_hide_closed_pipes)
        await self.stop(name)
        watcher = Watcher(
            name,
            shlex.quote(sys.executable),
            args=list(args),
            copy_env=True,
            working_dir=os.getcwd(),
            close_child_stdin=False,
            respawn=False,
            singleton=True,
            max_retry=1,
            graceful_timeout=GRACE,
            stderr_stream={
                "class": "FileStream",
                "filename": str(self.log_file(log or name)),
                "max_bytes": LOG_SIZE,
                "backup_count": LOGS_KEPT,
            },
        )
        self._watchers[name] = watcher
        await watcher._start()
        pid = self.pid(name)
        if pid is None:
            raise OSError(f"{name} could not be started")
        return pid

    def pid(self, name: str) -> int | None:
        """Process id, None when there is none."""
        watcher = self._watchers.get(name)
        return next(iter(watcher.processes), None) if watcher is not None else None

    async def rename(self, name: str, new: str) -> int | None:
        """Let a process go by another's name, which is ended; its process id, None if it died."""
        await self.stop(new)
        self._watchers[new] = self._watchers.pop(name)
        return self.pid(new)

    def reap(self) -> dict[str, int]:
        """Names of processes that have died, with exit code (negative: signal)."""
        out: dict[str, int] = {}
        for name, watcher in self._watchers.items():
            for pid in list(watcher.processes):
                try:
                    done, status = os.waitpid(pid, os.WNOHANG)
                except ChildProcessError:
                    done, status = pid, 0
                if done:
                    watcher.reap_process(pid, status)
                    out[name] = os.waitstatus_to_exitcode(status)
        return out

    def kill(self, name: str) -> None:
        """Kill a process that cannot be asked any more."""
        pid = self.pid(name)
        if pid is not None:
            os.kill(pid, signal.SIGKILL)

    async def stop(self, name: str) -> None:
        """Ask a process to end, kill it if it does not, close its log."""
        watcher = self._watchers.pop(name, None)
        if watcher is not None:
            pids = list(watcher.processes)
            for pid in pids:  # a stopped process does not hear that it is to end
                os.kill(pid, signal.SIGCONT)
            await watcher._stop(True)

    async def stop_all(self, last: str) -> None:
        """End all in parallel, but ``last`` after the others and with time to finish its work."""
        await asyncio.gather(*(self.stop(name) for name in list(self._watchers) if name != last))
        if last in self._watchers:
            self._watchers[last].graceful_timeout = PATIENT_GRACE
            await self.stop(last)
