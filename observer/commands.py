"""The platform commands as the drive acts on them: piecewise constant, with a watchdog."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from itertools import pairwise

Command = tuple[float, float, float]
STILL: Command = (0.0, 0.0, 0.0)


class CommandHistory:
    """Velocity commands by the instant at which the drive starts to act on them.

    Where commands come late, those that the base said it would give stand in for them: after the
    newest command until a newer one comes, and no longer than the drive would wait for one.

    Args:
        silence: after this long without a new command the drive stops by itself [s].
        period: between commands [s].
    """

    def __init__(self, silence: float = 0.1, period: float = 0.05) -> None:
        self.silence = silence
        self.period = period
        self._planned: list[tuple[float, Command]] = []
        self._times: list[float] = []
        self._values: list[Command] = []

    def __len__(self) -> int:
        return len(self._times)

    def insert(self, t: float, value: Command) -> bool:
        """Add a command acting from ``t`` [s] on; False if one with that instant is there."""
        i = bisect_left(self._times, t)
        if i < len(self._times) and self._times[i] == t:
            return False
        self._times.insert(i, t)
        self._values.insert(i, value)
        if i == len(self._times) - 1:
            self._planned = []
        return True

    def plan(self, t: float, values: Sequence[Command]) -> None:
        """Take in what is to follow the command acting from ``t`` [s] on, if that is the newest."""
        if self._times and t == self._times[-1] and values:
            self._planned = [
                (t + self.period * n, value) for n, value in enumerate(values, start=1)
            ]

    def at(self, t: float) -> Command:
        """The command acting at ``t``; zero before the first and after ``silence``."""
        i = bisect_right(self._times, t) - 1
        if i < 0 or t >= self._times[i] + self.silence:
            return STILL
        if self._planned and i == len(self._times) - 1:
            return self._meant(t)
        return self._values[i]

    def _meant(self, t: float) -> Command:
        """The newest command or the planned one acting at ``t``."""
        value = self._values[-1]
        for begin, planned in self._planned:
            if t < begin:
                break
            value = planned
        return value

    def still_since(self, t: float) -> float:
        """How long at ``t`` [s] the drive has been told to stand; inf if ever."""
        i = bisect_right(self._times, t) - 1
        if i >= 0 and t < self._times[i] + self.silence and self._values[i] != STILL:
            return 0.0
        while i >= 0:
            if self._values[i] != STILL:
                after = self._times[i + 1] if i + 1 < len(self._times) else math.inf
                return t - min(after, self._times[i] + self.silence)
            i -= 1
        return math.inf

    def segments(self, start: float, end: float) -> list[tuple[float, Command]]:
        """Cut ``start`` .. ``end`` [s] into pieces of constant command: (duration, command)."""
        pieces = []
        times, silence = self._times, self.silence
        i = bisect_right(times, start) - 1
        newest = i >= 0 and i == len(times) - 1
        if newest and self._planned and end > self._planned[0][0]:
            return self._segments_planned(start, end)
        if newest and end <= times[i] + silence:  # nearly always
            return [(end - start, self._values[i])] if end > start else []
        t = start
        while t < end:
            upto = times[i + 1] if i + 1 < len(times) else math.inf
            value = STILL
            if i >= 0:
                stop = times[i] + silence
                if t < stop:
                    value, upto = self._values[i], min(upto, stop)
            if upto >= end:
                pieces.append((end - t, value))
                break
            if upto > t:
                pieces.append((upto - t, value))
            t = upto
            i = bisect_right(times, t) - 1
        return pieces

    def _segments_planned(self, start: float, end: float) -> list[tuple[float, Command]]:
        """Likewise where no newer command has come: planned ones, then the drive's stop."""
        stop = self._times[-1] + self.silence
        marks = [b for b, _ in self._planned if b < stop] + [stop]
        edges = [start, *(m for m in marks if start < m < end), end]
        return [(b - a, self.at(a)) for a, b in pairwise(edges) if b > a]

    def forget(self, before: float) -> None:
        """Drop commands that no instant from ``before`` [s] on can need."""
        i = bisect_right(self._times, before) - 1
        if i > 0:
            del self._times[:i], self._values[:i]
