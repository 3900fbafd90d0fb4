"""All services in one process on simulated time: a run is a pure function of scenario and seed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence

from services.messages import Message
from services.service import Inbox, Service
from services.topics import Topic

TICK = 0.001  # [s]

Listener = Callable[[Topic, Message, float], None]
"""Called with topic, message and the robot time at which it was sent [s]."""


class Lockstep:
    """Steps services in a fixed order; every message takes ``latency`` ticks to arrive.

    Args:
        services: in stepping order; the sim first.
        latency: modelled age of a message when it is first seen [ticks of 1 ms], at least 1.
        listener: called with every message as it is sent.
        late: ticks that messages of a topic, by its name, take on top of that.
    """

    def __init__(
        self,
        services: Sequence[Service],
        latency: int = 1,
        listener: Listener | None = None,
        late: Mapping[str, int] | None = None,
    ) -> None:
        if latency < 1:
            raise ValueError(f"latency is {latency} ticks; a message takes at least 1")
        if late and min(late.values()) < 0:
            raise ValueError("no message arrives before the others do")
        self.services = list(services)
        self.latency = latency
        self.tick = 0
        self._listener = listener
        self._stepped = [
            (s, Inbox(s.inputs), max(1, round(s.period / TICK))) for s in self.services
        ]
        self._readers: dict[str, list[Inbox]] = {}
        for service, inbox, _ in self._stepped:
            for topic in service.inputs:
                self._readers.setdefault(topic.name, []).append(inbox)
        # by flight time: what left first arrives first
        self._late = dict(late or {})
        self._flights: dict[int, deque[tuple[int, Topic, Message]]] = {
            extra: deque() for extra in sorted({0, *self._late.values()}, reverse=True)
        }

    @property
    def now(self) -> float:
        """Robot time of the next tick [s]."""
        return self.tick * TICK

    def step(self) -> None:
        """Run one tick of 1 ms."""
        tick, now, late, listener = self.tick, self.now, self._late, self._listener
        for flying in self._flights.values():
            while flying and flying[0][0] <= tick:
                _, topic, message = flying.popleft()
                for inbox in self._readers.get(topic.name, ()):
                    inbox.offer(topic, message)
        for service, inbox, every in self._stepped:
            if tick % every:
                continue
            for topic, message in service.step(now, inbox):
                if listener is not None:
                    listener(topic, message, now)
                extra = late.get(topic.name, 0) if late else 0
                self._flights[extra].append((tick + self.latency + extra, topic, message))
        self.tick += 1
