"""A fixed-rate loop on absolute deadlines, and what is known about how well it kept them."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

import numpy as np

from services.messages import Health

HEARTBEAT = 0.2  # [s]
UNANSWERED = 1000  # questions that are remembered


class LoopStatistics:
    """Period and lateness of the ticks since the last report; counts since start."""

    def __init__(self, target: float) -> None:
        self.target = target
        self.progress = 0
        self.overruns = 0
        self._starts: list[float] = []
        self._lateness: list[float] = []
        self._last: float | None = None

    def tick(self, start: float, lateness: float, missed: int = 0) -> None:
        """Record a tick that began at ``start``, ``lateness`` behind its deadline [s]."""
        self.progress += 1
        self.overruns += missed
        if self._last is not None:
            self._starts.append(start - self._last)
        self._last = start
        self._lateness.append(max(0.0, lateness))
        if len(self._lateness) > 100_000:  # nobody asked for a report: keep memory bounded
            del self._lateness[:50_000], self._starts[:50_000]

    def report(self) -> tuple[dict[str, float], dict[str, float]]:
        """Period (target, mean, std, max) and lateness (p50, p99, max) [s], starting anew.

        ``over_1ms`` is the share of the ticks that were later than that.
        """
        period = {"target": self.target}
        if self._starts:
            gaps = np.array(self._starts)
            period |= {
                "mean": float(gaps.mean()),
                "std": float(gaps.std()),
                "max": float(gaps.max()),
            }
        lateness = {}
        if self._lateness:
            lateness = _spread(self._lateness)
            lateness["over_1ms"] = float(np.mean(np.array(self._lateness) > 1e-3))
        self._starts, self._lateness = [], []
        return period, lateness


class FixedRate:
    """Waits for the next deadline; skips and counts the ones that passed, never bursts.

    Args:
        period: time between ticks [s].
        spin: busy-wait this long before each deadline [s]; 0 only sleeps.
        clock: monotonic time [s].
        sleep: how to wait [s].
    """

    def __init__(
        self,
        period: float,
        spin: float = 0.0,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.period = period
        self.spin = spin
        self.statistics = LoopStatistics(period)
        self._clock = clock
        self._sleep = sleep
        self._deadline: float | None = None

    def wait(self) -> float:
        """Return at the next deadline, with the instant of the clock."""
        now = self._clock()
        missed = 0
        if self._deadline is None:
            self._deadline = now
            due = now
        else:
            self._deadline += self.period
            due = self._deadline  # lateness counts from the first deadline that was not served
            if now - self._deadline >= self.period:
                missed = int((now - self._deadline) / self.period)
                self._deadline += missed * self.period
        rest = self._deadline - now - self.spin
        if rest > 0:
            self._sleep(rest)
        now = self._clock()
        while now < self._deadline:
            if not self.spin:
                self._sleep(self._deadline - now)
            now = self._clock()
        self.statistics.tick(now, now - due, missed)
        return now


class Driven:
    """Waits for an arrival; ticks at its period as well when arrivals stay away.

    Args:
        period: nominal time between arrivals [s].
        arrived: set by whoever brings an arrival.
        arrived_at: instant of the newest arrival [s].
        clock: monotonic time [s].
    """

    GRACE = 2.5  # periods an arrival may be late before a tick goes ahead without it

    def __init__(
        self,
        period: float,
        arrived: threading.Event,
        arrived_at: Callable[[], float],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.period = period
        self.statistics = LoopStatistics(period)
        self._arrived = arrived
        self._arrived_at = arrived_at
        self._clock = clock
        self._driven = False
        self._last: float | None = None

    def wait(self) -> float:
        """Return at the next arrival, or without one; with the instant of the clock."""
        self._driven = self._arrived.wait(self.period * (self.GRACE if self._driven else 1.0))
        self._arrived.clear()
        now = self._clock()
        missed = 0 if self._last is None else max(0, round((now - self._last) / self.period) - 1)
        self._last = now
        lateness = now - self._arrived_at() if self._driven else 0.0
        self.statistics.tick(now, lateness, missed)
        return now


class Answers:
    """How long answers take to what is asked at a robot time; kept since the last report."""

    def __init__(self) -> None:
        self._asked: dict[float, float] = {}
        self._took: list[float] = []

    def asked(self, t: float, at: float) -> None:
        """A question about robot time ``t`` was sent at ``at`` [s]."""
        self._asked[t] = at
        if len(self._asked) > UNANSWERED:
            del self._asked[next(iter(self._asked))]

    def answered(self, t: float, at: float) -> None:
        """The answer to it was heard; one to nothing that was asked is left out."""
        asked = self._asked.pop(t, None)
        if asked is not None:
            self._took.append(at - asked)

    def report(self) -> dict[str, float]:
        """p50, p99, max [s]; empty without answers. Starts anew."""
        took, self._took = self._took, []
        return _spread(took) if took else {}


def _spread(values: list[float]) -> dict[str, float]:
    """p50, p99 and max."""
    v = np.sort(values)
    return {
        "p50": float(v[(len(v) - 1) // 2]),
        "p99": float(v[math.ceil(0.99 * len(v)) - 1]),
        "max": float(v[-1]),
    }


def heartbeat(
    statistics: LoopStatistics,
    service: str,
    state: tuple[str, str],
    now: float,
    pid: int,
    ages: dict[str, float],
    refused: dict[str, int],
    answers: dict[str, float],
    restarts: int = 0,
) -> Health:
    """The heartbeat of a loop, stamped inside it; ages of what was never heard are left out."""
    period, lateness = statistics.report()
    return Health(
        t=max(0.0, now),
        service=service,
        state=state[0],
        detail=state[1],
        progress=statistics.progress,
        pid=pid,
        restarts=restarts,
        period=period,
        lateness=lateness,
        overruns=statistics.overruns,
        ages={name: age for name, age in ages.items() if math.isfinite(age)},
        refused=refused,
        answers=answers,
    )
