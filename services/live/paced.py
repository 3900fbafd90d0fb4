"""Runs services over the bus tick by tick: every message waited for, none dropped.

The robot (the sim) calls tick k and names, per topic, the newest message that may be used in it:
what was sent in tick k-1 or before. A service that is due waits for exactly those, withholds
later ones, steps, and answers with what it sent. The result is that of ``Lockstep`` with a
latency of one tick, bit for bit, on any machine, however slow.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable

from services.live.loop import LoopStatistics
from services.live.runner import Heart
from services.lockstep import TICK
from services.messages import Message, Tick
from services.requests import Requests
from services.service import Inbox, Service
from services.topics import REQUEST, ROBOT_PROCESS, SIM_TICK, Topic
from services.topics import TICK as TICK_TOPIC
from services.wire.bus import Bus

HELLO, READY, END = -1, -2, -3  # numbers of ticks that are none
PATIENCE = 10.0  # [s] for an answer
START = 60.0  # [s] for everybody to be there
_POLL = 0.05  # [s]


class PacedError(RuntimeError):
    """A paced run cannot go on; the text names who is missing."""


class _Paced:
    """What robot and services have in common: inputs by number, waiting, heartbeat."""

    def __init__(
        self, service: Service, bus: Bus, stop: threading.Event, requests: Requests | None
    ) -> None:
        if not bus.lossless:
            raise ValueError("a paced run needs a bus that drops nothing")
        self.service, self.bus, self.stop, self.requests = service, bus, stop, requests
        self.every = max(1, round(service.period / TICK))
        self.sent: dict[str, int] = {}
        self.inbox = Inbox(service.inputs)
        self.statistics = LoopStatistics(service.period)
        self.heart = Heart(service, bus, self.statistics)
        self.now = 0.0
        self._heard: dict[str, deque[tuple[int, Message]]] = {}
        self._newest: dict[str, int] = {}
        self._refused: dict[str, int] = {}
        for topic in service.inputs:
            bus.hear(topic)
            bus.wake_on(topic)
            self._heard[topic.name] = deque()

    def until(self, done: Callable[[], bool], patience: float, missing: Callable[[], str]) -> bool:
        """Wait for a condition that arrivals bring about; False when the run is to end.

        Raises:
            PacedError: it took longer than ``patience`` [s].
        """
        deadline = time.monotonic() + patience
        while True:
            self.bus.arrived.clear()
            if done():
                return True
            if self.stop.is_set():
                return False
            if time.monotonic() > deadline:
                refused = f"; refused so far: {dict(self.bus.refused)}" if self.bus.refused else ""
                raise PacedError(f"{self.service.name}: {missing()}{refused}")
            self.bus.arrived.wait(_POLL)
            # waiting is work too: who waits in vain is alive, and others must see that
            self.statistics.progress += 1
            self.heart.beat(self.now, self.inbox)

    def step(self, number: int, usable: dict[str, int]) -> bool:
        """Take tick ``number`` with the messages that may be used in it."""
        wanted = {n: usable[n] for n in self._heard if n in usable}

        def lacking() -> list[str]:
            return [n for n, seq in wanted.items() if self._newest.get(n, -1) < seq]

        def complete() -> bool:
            for topic in self.service.inputs:
                for seq, message in self.bus.take(topic):
                    self._heard[topic.name].append((seq, message))
                    self._newest[topic.name] = seq
                self._skip_refused(topic.name)
            return not lacking()

        if not self.until(
            complete, PATIENCE, lambda: f"{', '.join(lacking())} of tick {number} did not arrive"
        ):
            return False
        for topic in self.service.inputs:
            heard = self._heard[topic.name]
            while heard and heard[0][0] <= wanted.get(topic.name, -1):
                self.inbox.offer(topic, heard.popleft()[1])
        self.now = number * TICK
        if self.requests is not None:
            for done in self.requests.run_pending(self.now):
                self.bus.publish(REQUEST[self.service.name], done)
        for topic, message in self.service.step(self.now, self.inbox):
            self.sent[topic.name] = self.bus.publish(topic, message)
        self.statistics.tick(time.monotonic(), 0.0)
        self.heart.beat(self.now, self.inbox)
        return True

    def _skip_refused(self, name: str) -> None:
        """What came and was refused will not come again: whoever waits for it goes on without."""
        refused = sum(n for what, n in self.bus.refused.items() if what.startswith(f"{name}: "))
        more = refused - self._refused.get(name, 0)
        if more:
            self._refused[name] = refused
            self._newest[name] = self._newest.get(name, -1) + more  # numbers leave none out


class _Leader(_Paced):
    """The robot: calls the ticks and waits for the answers."""

    def run(self, ticks: int | None, others: list[str]) -> None:
        self.others = {name: TICK_TOPIC[name] for name in others}
        self.every_of: dict[str, int] = {}
        self.answered: dict[str, int] = {}
        self.answers: dict[str, int] = {}
        for topic in self.others.values():
            self.bus.hear(topic)
            self.bus.wake_on(topic)
        self.call_hello = _Repeat(lambda: self.bus.publish(SIM_TICK, Tick(t=0.0, number=HELLO)))
        if not self.until(self.everybody, START, self.absent):
            return
        usable: dict[str, int] = {}
        for number in itertools.count() if ticks is None else range(ticks):
            # called before our own step: the others work while we do
            self.bus.publish(SIM_TICK, Tick(t=number * TICK, number=number, sent=dict(usable)))
            if number % self.every == 0 and not self.step(number, usable):
                return
            self.due = [name for name in others if number % self.every_of[name] == 0]
            self.number = number
            if not self.until(self.all_answered, PATIENCE, self.silent):
                return
            usable |= self.answers | self.sent
        self.bus.publish(SIM_TICK, Tick(t=self.now, number=END))

    def everybody(self) -> bool:
        self.call_hello()
        for name, topic in self.others.items():
            for _, tick in self.bus.take(topic):
                if tick.number == READY:
                    self.every_of[name] = max(1, tick.sent.get("every", 1))
        return len(self.every_of) == len(self.others)

    def absent(self) -> str:
        return f"{', '.join(sorted(set(self.others) - set(self.every_of)))} did not come"

    def missing(self) -> list[str]:
        return [name for name in self.due if self.answered.get(name, -1) < self.number]

    def all_answered(self) -> bool:
        for name, topic in self.others.items():
            for _, tick in self.bus.take(topic):
                if tick.number >= 0:
                    self.answered[name] = tick.number
                    self.answers |= tick.sent
        return not self.missing()

    def silent(self) -> str:
        return f"no answer to tick {self.number} from {', '.join(self.missing())}"


class _Follower(_Paced):
    """Every other service: answers the ticks at which it is due."""

    def run(self, others: list[str]) -> None:
        owners = {topic.owner for topic in self.service.inputs} - {ROBOT_PROCESS, self.service.name}
        owners &= set(others)
        self.waited: dict[str, Topic[Tick]] = {name: TICK_TOPIC[name] for name in owners}
        self.met: set[str] = set()
        self.calls: deque[Tick] = deque()
        self.answer = TICK_TOPIC[self.service.name]
        self.say_hello = _Repeat(self.introduce)
        # subscribed to last: who is heard on these knows all our subscriptions
        for topic in (*self.waited.values(), SIM_TICK):
            self.bus.hear(topic)
            self.bus.wake_on(topic)
        if not self.until(self.first_call, float("inf"), str):
            return
        for topic in self.waited.values():
            self.bus.forget(topic)
        while self.until(self.called, float("inf"), str):
            tick = self.calls.popleft()
            if tick.number == END:
                return
            if tick.number % self.every:
                continue
            if not self.step(tick.number, tick.sent):
                return
            self.bus.publish(self.answer, Tick(t=tick.t, number=tick.number, sent=dict(self.sent)))

    def introduce(self) -> None:
        ready = self.met >= {*self.waited, ROBOT_PROCESS}
        number, sent = (READY, {"every": self.every}) if ready else (HELLO, {})
        self.bus.publish(self.answer, Tick(t=0.0, number=number, sent=sent))

    def first_call(self) -> bool:
        self.met.update(name for name, topic in self.waited.items() if self.bus.take(topic))
        called = self.called()
        self.say_hello()
        return called

    def called(self) -> bool:
        for _, tick in self.bus.take(SIM_TICK):
            self.met.add(ROBOT_PROCESS)
            if tick.number != HELLO:
                self.calls.append(tick)
        return bool(self.calls)


def run_paced(
    service: Service,
    bus: Bus,
    stop: threading.Event,
    requests: Requests | None = None,
    ticks: int | None = None,
    others: Iterable[str] = tuple(TICK_TOPIC),
) -> None:
    """Run a service tick by tick until the robot ends the run, or ``stop`` is set.

    Args:
        service: to run; the robot leads, every other one follows.
        bus: opened with ``lossless=True``.
        stop: ends the run.
        requests: whose actions are executed between steps.
        ticks: after how many ticks the robot ends the run; None for never.
        others: the services that run besides the robot.

    Raises:
        PacedError: somebody did not come, or did not answer within 10 s; who is named.
    """
    if service.name == ROBOT_PROCESS:
        _Leader(service, bus, stop, requests).run(ticks, list(others))
    else:
        _Follower(service, bus, stop, requests).run(list(others))


class _Repeat:
    """Does something at most every so often."""

    def __init__(self, action: Callable[[], object], period: float = 0.1) -> None:
        self._action = action
        self._period = period
        self._next = 0.0

    def __call__(self) -> None:
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + self._period
            self._action()
