"""How long a loop has stood still although it could have gone on: tells a hang from a busy machine.

While no pulse comes, time counts by what the kernel says of the process:

- stopped, or all of its threads asleep: all of it. Our loops never sleep for as long as a hang is.
- a thread is running, or waits for a processor: as much as the process was given of one. Who holds
  the interpreter's lock burns time; who is starved gets none, and none is held against it.
- a thread waits for a disk, or for a page: none.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from services.live.pulse import PERIOD

SILENT = 2.5 * PERIOD
"""After so long without a pulse one looks closer [s]; it costs some reads of /proc."""
AT_ONCE = 2 * PERIOD
"""A look adds no more than this [s]: who looks late may have stood still with all the others."""
_TICK = 1.0 / os.sysconf("SC_CLK_TCK")  # [s]

Look = tuple[str, float]
"""States of a process' threads, a letter each (proc(5)), and processor time it had so far [s]."""


def look(pid: int) -> Look:
    """What the kernel says of a process; no states once it is gone."""
    states, used = "", 0.0
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            with suppress(OSError):  # a thread that has just ended
                fields = (task / "stat").read_text().rpartition(")")[2].split()
                states += fields[0]
                used += (int(fields[11]) + int(fields[12])) * _TICK
    return states, used


class Stillness:
    """Of one process, from one pulse to the next.

    Args:
        look: how to look at a process.
    """

    def __init__(self, look: Callable[[int], Look] = look) -> None:
        self.seconds = 0.0
        """So long it has stood still though it could have gone on."""
        self._look = look
        self._last = 0.0
        self._used: float | None = None

    def went_round(self, now: float) -> None:
        """There was a pulse, or it has just been started, at local time ``now`` [s]."""
        self.seconds, self._last, self._used = 0.0, now, None

    def watch(self, pid: int, now: float) -> float:
        """There was none; returns ``seconds``.

        Args:
            pid: of the process.
            now: local monotonic time [s].
        """
        if self._used is None and now - self._last < SILENT:
            return self.seconds
        states, used = self._look(pid)
        self.seconds += min(now - self._last, AT_ONCE, _could_have(states, used, self._used))
        self._last, self._used = now, used
        return self.seconds


def _could_have(states: str, used: float, before: float | None) -> float:
    """At most so much of the time since the last look was the process' own [s]."""
    if "T" in states or "t" in states:
        return float("inf")
    if "R" in states:
        return 0.0 if before is None else max(used - before, 0.0)  # a thread may have ended
    return 0.0 if "D" in states else float("inf")
