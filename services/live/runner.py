"""Runs a service live: real time, over the bus, at its own rate."""

from __future__ import annotations

import gc
import os
import threading
import time
from collections.abc import Callable
from typing import Protocol

from services.live.clock import RobotClock
from services.live.loop import HEARTBEAT, Answers, Driven, FixedRate, LoopStatistics, heartbeat
from services.live.pulse import Pulse
from services.messages import Clock, Message
from services.requests import Requests
from services.service import Arrivals, Inbox, Service
from services.topics import ARM_COMMAND, ARM_STATE, CLOCK, HEALTH, REQUEST, ROBOT_PROCESS, Topic
from services.wire.bus import Bus

CLOCK_TICKS = 5
"""Ticks of the robot between two messages that say its time."""


class Pace(Protocol):
    """Waits for the next tick and keeps statistics."""

    statistics: LoopStatistics

    def wait(self) -> float:
        """Return at the next tick."""
        ...


class Heart:
    """Publishes a service's heartbeat from inside its loop, and beats its pulse.

    Args:
        service: whose.
        bus: its own.
        statistics: of its loop.
        restarts: how often the service was restarted before.
        pulse: None without a supervisor that listens.
    """

    def __init__(
        self,
        service: Service,
        bus: Bus,
        statistics: LoopStatistics,
        restarts: int = 0,
        pulse: Pulse | None = None,
    ) -> None:
        self._service = service
        self._restarts = restarts
        self._bus = bus
        self._statistics = statistics
        self._topic = HEALTH[service.name]
        self._pid = os.getpid()
        self._pulse = pulse
        self._next = 0.0
        self.answers = Answers()
        bus.declare(self._topic)

    def beat(self, now: float, inbox: Inbox, state: tuple[str, str] | None = None) -> None:
        """Publish if it is time to; ``state`` instead of the service's own."""
        local = time.monotonic()
        if self._pulse is not None:
            self._pulse.beat(local)
        if local < self._next:
            return
        self._next = local + HEARTBEAT
        if not gc.isenabled():  # the loop runs without collector: sweep the young ones here
            gc.collect(1)
        ages = {topic.name: inbox.age(topic, now) for topic in self._service.inputs}
        refused = {**self._bus.refused, **{f"{n}: lost": k for n, k in self._bus.lost.items()}}
        health = heartbeat(
            self._statistics,
            self._service.name,
            state or self._service.state(),
            now,
            self._pid,
            ages,
            refused,
            self.answers.report(),
            self._restarts,
        )
        self._bus.publish(self._topic, health)


class Grid:
    """Instants at which the simulated world is stepped.

    A controller that missed ticks skips them. A world cannot leave time out: it makes up for a
    few, and when there are more its time stands still for the rest, so that robot time and
    motion always agree.

    Args:
        period: of the world [s].
        slip: takes robot time back by so much [s].
    """

    CATCH_UP = 2  # ticks: more at once and the arm would be steered by what it was told long ago

    def __init__(self, period: float, slip: Callable[[float], None] = lambda seconds: None) -> None:
        self._period = period
        self._slip = slip
        self._last: int | None = None

    def due(self, now: float) -> list[float]:
        """Multiples of the period that have come since the last call [s]."""
        newest = int(now / self._period + 1e-6)
        if self._last is None:
            self._last = newest - 1
        excess = newest - self._last - self.CATCH_UP
        if excess > 0:
            self._slip(excess * self._period)
            newest -= excess
        first, self._last = self._last + 1, max(newest, self._last)
        return [number * self._period for number in range(first, newest + 1)]


def run_live(
    service: Service,
    bus: Bus,
    clock: RobotClock,
    stop: threading.Event,
    requests: Requests | None = None,
    spin: float = 0.0,
    restarts: int = 0,
    pulse: Pulse | None = None,
) -> None:
    """Step a service until ``stop`` is set.

    Nothing is stepped before robot time is known; the heartbeat says so. The robot itself (the
    simulation) is stepped on multiples of its period, see ``Grid``; a service that is driven by
    arrivals on each of these, and without them at their period.

    Args:
        service: to run.
        bus: hears the service's inputs.
        clock: robot time.
        stop: ends the run at the next tick.
        requests: whose actions are executed between steps.
        spin: busy-wait before each deadline [s].
        restarts: how often the service was restarted before.
        pulse: tells the supervisor that the loop goes round.
    """
    pace: Pace
    trigger: Arrivals | None = getattr(service, "driven_by", None)
    if trigger is not None:
        bus.hear(trigger.topic)
        bus.wake_on(trigger.topic)
        pace = Driven(trigger.period, bus.arrived, lambda: bus.arrived_at)
    else:
        pace = FixedRate(service.period, spin)
    tells = service.name == ROBOT_PROCESS or trigger is not None
    hears = any(topic.name == CLOCK.name for topic in service.inputs)
    extra = () if tells or hears else (CLOCK,)
    for topic in (*service.inputs, *extra):
        bus.hear(topic)
    inbox = Inbox((*service.inputs, *extra))
    heart = Heart(service, bus, pace.statistics, restarts, pulse)
    grid = Grid(service.period, clock.slip) if service.name == ROBOT_PROCESS else None
    while not stop.is_set():
        pace.wait()
        if requests is not None:
            for done in requests.run_pending(clock.now() or 0.0):
                bus.publish(REQUEST[service.name], done)
        accepted = bus.drain(inbox, clock.now())
        _hear(clock, accepted)
        for topic, message, at in accepted:
            if grid is not None and topic is ARM_COMMAND:
                heart.answers.answered(message.t, at)
        now = clock.now()
        if now is None:
            heart.beat(0.0, inbox, ("waiting", "no robot time heard yet"))
            continue
        for instant in grid.due(now) if grid is not None else (now,):
            if grid is not None and round(instant / service.period) % CLOCK_TICKS == 0:
                bus.publish(CLOCK, Clock(t=instant))
            for topic, message in service.step(instant, inbox):
                if topic is ARM_STATE:
                    heart.answers.asked(message.t, time.monotonic())
                bus.publish(topic, message)
        heart.beat(now, inbox)


def _hear(clock: RobotClock, accepted: list[tuple[Topic, Message, float]]) -> None:
    for topic, message, at in accepted:
        if topic.owner == ROBOT_PROCESS:
            clock.hear(message.t, at)
