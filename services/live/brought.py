"""Services that somebody else starts, as the ``sim`` of a real robot: heard, judged, left alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from services.messages import Health

Tell = Callable[[str, str, str], None]


class Brought:
    """Whether services that are not ours to start or end go round, by their heartbeats.

    Args:
        names: of the services.
        silent: a heartbeat that makes no progress for so long is a hang [s].
        tell: is told of a service, what became of it (ready, hung, restarted), and how.
    """

    def __init__(self, names: Iterable[str], silent: float, tell: Tell) -> None:
        self._silent, self._tell = silent, tell
        self._pid = dict.fromkeys(names, 0)
        self._progress = dict.fromkeys(self._pid, -1)
        self._advanced = dict.fromkeys(self._pid, -math.inf)
        self._alive = dict.fromkeys(self._pid, False)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the services."""
        return tuple(self._pid)

    @property
    def missing(self) -> list[str]:
        """Those that do not go round now."""
        return [name for name, alive in self._alive.items() if not alive]

    def hear(self, name: str, health: Health, now: float) -> None:
        """Take in a heartbeat, heard at local monotonic time ``now`` [s]."""
        if health.pid == self._pid[name] and health.progress <= self._progress[name]:
            return
        before, self._pid[name] = self._pid[name], health.pid
        self._progress[name], self._advanced[name] = health.progress, now
        if not self._alive[name] or health.pid != before:
            self._alive[name] = True
            kind = "restarted" if before else "ready"
            self._tell(name, kind, f"process {health.pid}, brought by somebody else")

    def excuse(self, now: float) -> None:
        """Until ``now`` [s] nobody listened: nothing is held against anybody."""
        self._advanced = dict.fromkeys(self._pid, now)

    def judge(self, now: float) -> None:
        """Tell of those that have gone silent by local monotonic time ``now`` [s]."""
        for name, alive in self._alive.items():
            if alive and now - self._advanced[name] > self._silent:
                self._alive[name] = False
                why = f"no progress for {self._silent:.1f} s; it is not ours to restart"
                self._tell(name, "hung", why)
