"""Robot time: one time base for all processes, without agreement of their clocks."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

WINDOW = 0.04  # [s]; the robot's time may slip: what was heard long ago leads astray
ASTRAY = 0.25  # [s]; further ahead than this of all that is heard, we were led astray


class RobotClock(Protocol):
    """Tells robot time."""

    def now(self) -> float | None:
        """Robot time [s]; None as long as it is not known."""
        ...

    def hear(self, t: float, at: float) -> None:
        """Take note that robot time ``t`` had passed at local monotonic time ``at`` [s]."""
        ...

    def slip(self, seconds: float) -> None:
        """Robot time stood still for so long, because the robot's process could not follow."""
        ...


class EpochClock:
    """Of the process that is the robot: local monotonic time since an epoch.

    The supervisor gives the epoch, so that robot time goes forward across a restart.
    """

    def __init__(self, epoch: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._epoch = epoch
        self._clock = clock

    def now(self) -> float:
        """Robot time [s]."""
        return self._clock() - self._epoch

    def hear(self, t: float, at: float) -> None:
        """Nothing: this process is the one that knows."""

    def slip(self, seconds: float) -> None:
        """Move the epoch."""
        self._epoch += seconds


class HeardClock:
    """Of every other process: newest robot time heard plus local monotonic time since.

    The message that travelled fastest within the last one to two windows counts, so that late
    sensors do not pull the clock back and a drift between hosts is followed. It does not go back,
    except after it was led far ahead, by a stranger or by a step of this host's own clock.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._start: float | None = None
        self._current = self._previous = -float("inf")
        self._last = 0.0

    def hear(self, t: float, at: float) -> None:
        """Take note that robot time ``t`` had passed at local monotonic time ``at`` [s]."""
        if self._start is None or at - self._start > WINDOW:
            self._start, self._previous, self._current = at, self._current, t - at
        else:
            self._current = max(self._current, t - at)

    def now(self) -> float | None:
        """Robot time [s]; None before the robot was heard."""
        if self._start is None:
            return None
        heard = self._clock() + max(self._previous, self._current)
        if heard > self._last or heard < self._last - ASTRAY:
            self._last = heard
        return self._last

    def slip(self, seconds: float) -> None:
        """Nothing: only the robot's own process can hold its time."""
