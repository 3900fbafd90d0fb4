"""Processes that have imported and built everything, and wait: a restart takes them.

Most of a restart is importing. A spare does it beforehand (``standby``) and waits at a named pipe
until it is told to take over.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

from services.live.pool import Pool
from services.live.standby import ready_mark

APART = 4.0
"""Time between the starts of two [s]: importing takes a core."""


class Spares:
    """At most one spare a service.

    Args:
        pool: starts them, as ``NAME.spare``.
        run_dir: for their pipes.
    """

    def __init__(self, pool: Pool, run_dir: Path) -> None:
        self._pool, self._run_dir = pool, run_dir
        self._pipes: dict[str, tuple[Path, int]] = {}
        self._next = 0.0

    async def keep(self, name: str, args: Sequence[str]) -> None:
        """See to it that there is one; called again and again while all is well.

        Args:
            name: of the service.
            args: that would restart it.
        """
        now = time.monotonic()
        if name in self._pipes or now < self._next:
            return
        self._next = now + APART
        pipe = self._run_dir / f"{name}.spare"
        pipe.unlink(missing_ok=True)
        _was_ready(pipe)  # of a supervisor before us
        os.mkfifo(pipe, 0o600)
        self._pipes[name] = (pipe, os.open(pipe, os.O_RDWR))  # for both: opening never waits
        await self._pool.start(spare_of(name), [*args, "--spare", str(pipe)], log=name)

    async def take(self, name: str) -> int | None:
        """Set the spare to work in place of the service; its process id, None if there is none."""
        if name not in self._pipes:
            return None
        pipe, writer = self._pipes.pop(name)
        ready = _was_ready(pipe)
        if ready:
            os.write(writer, b"\n")
        os.close(writer)
        if not ready:
            await self._pool.stop(spare_of(name))
            return None
        return await self._pool.rename(spare_of(name), name)

    def forget(self, name: str) -> None:
        """The process of this name has died; does nothing if it is no spare."""
        for service in [n for n in self._pipes if spare_of(n) == name]:
            pipe, writer = self._pipes.pop(service)
            _was_ready(pipe)
            os.close(writer)


def _was_ready(pipe: Path) -> bool:
    """Whether a spare waits at a pipe; it does so no longer for anybody who looks."""
    mark = ready_mark(pipe)
    ready = mark.exists()
    mark.unlink(missing_ok=True)
    return ready


def spare_of(name: str) -> str:
    """Name of a service's spare."""
    return f"{name}.spare"
