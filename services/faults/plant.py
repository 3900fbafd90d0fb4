"""The system in one process on simulated time, over a wire with faults, with real admission.

As ``services/lockstep.py``, but messages are judged by the code that judges them live
(``services/wire/admission.py``), services tell robot time from what they hear, and may hang or die.
"""

from __future__ import annotations

import heapq
from collections import Counter, deque
from collections.abc import Callable, Sequence

import numpy as np

from services.faults import kinds as k
from services.faults.wire import FaultyWire, Parcel
from services.live.clock import EpochClock, HeardClock, RobotClock
from services.live.runner import CLOCK_TICKS
from services.lockstep import TICK, Listener
from services.messages import BadMessage, Clock
from services.service import Inbox, Service
from services.topics import CLOCK, ROBOT_PROCESS, Topic
from services.wire.admission import Admission
from services.wire.bus import RING

Build = Callable[[str], Service]


class Host:
    """One service with its slots, its clock and what it takes in.

    Attributes:
        refused: how many messages, by topic and reason.
    """

    def __init__(self, service: Service, local: Callable[[], float]) -> None:
        self.service = service
        self.refused: Counter[str] = Counter()
        self._local = local
        robot = service.name == ROBOT_PROCESS
        self._clock: RobotClock = EpochClock(0.0, local) if robot else HeardClock(local)
        topics = (*service.inputs, *(() if robot else (CLOCK,)))
        self._inbox = Inbox(topics)
        self._slots = {
            t.name: (Admission(t), deque[tuple[Parcel, float]](maxlen=max(t.depth, RING)))
            for t in topics
        }
        self.every = max(1, round(service.period / TICK))

    def hears(self, topic: Topic) -> bool:
        """Whether it is subscribed to a topic."""
        return topic.name in self._slots

    def arrives(self, topic: Topic, parcel: Parcel) -> None:
        """Put a parcel into its slot, whether or not anybody looks."""
        self._slots[topic.name][1].append((parcel, self._local()))

    def step(self) -> list[tuple[Topic, object]]:
        """Take in what arrived, then one step; nothing before robot time is known."""
        self._drain()
        now = self._clock.now()
        return [] if now is None else list(self.service.step(now, self._inbox))

    def _drain(self) -> None:
        now = self._clock.now()
        for admission, slot in self._slots.values():
            newest_only = admission.topic.depth == 1
            parcels = list(slot)
            slot.clear()
            for parcel, at in reversed(parcels) if newest_only else parcels:
                if self._take(admission, parcel, at, now) and newest_only:
                    break

    def _take(self, admission: Admission, parcel: Parcel, at: float, now: float | None) -> bool:
        topic, local = admission.topic, self._local()
        try:
            if parcel.payload is not None:
                message = admission.accept(parcel.payload, now, local)
            else:
                assert parcel.message is not None
                message = admission.admit(parcel.seq, parcel.message, now, local)
        except BadMessage as error:
            self.refused[f"{topic.name}: {error.reason}"] += 1
            return False
        self._inbox.offer(topic, message, at)
        if topic.owner == ROBOT_PROCESS:
            self._clock.hear(message.t, at)
        return True


class FaultyPlant:
    """Steps the services of a robot while faults happen.

    Args:
        services: in stepping order, the sim first.
        faults: what goes wrong.
        rebuild: a service anew, after it died.
        rng: for the wire.
        listener: called with every message as it is sent.
    """

    def __init__(
        self,
        services: Sequence[Service],
        faults: Sequence[k.Fault],
        rebuild: Build,
        rng: np.random.Generator,
        listener: Listener,
    ) -> None:
        self.tick = 0
        self.refused: Counter[str] = Counter()
        """Of services that died since."""
        self._faults = [f for f in faults if isinstance(f, k.OnService)]
        self._rebuild, self._listener = rebuild, listener
        self._wire = FaultyWire(faults, rng)
        self._seq: Counter[str] = Counter()
        self._flying: list[tuple[int, int, Topic, Parcel, str]] = []
        self._order = 0
        self._dead: set[str] = set()
        self.hosts = {s.name: Host(s, self._clock_of(s.name)) for s in services}

    @property
    def now(self) -> float:
        """Robot time of the next tick [s]."""
        return self.tick * TICK

    @property
    def missing(self) -> bool:
        """Whether a service is dead."""
        return bool(self._dead)

    def step(self) -> None:
        """Run one tick of 1 ms."""
        now = self.now
        self._deliver()
        for topic, parcel in self._wire.stray(now):
            self._fly(0, topic, parcel)
        for name in list(self.hosts):
            acting = [f for f in self._faults if f.service == name and f.active(now)]
            if self._lives(name, acting) and self.tick % self.hosts[name].every == 0:
                self._run(name, now)
        self.tick += 1

    def _run(self, name: str, now: float) -> None:
        sent = self.hosts[name].step()
        if name == ROBOT_PROCESS and self.tick % CLOCK_TICKS == 0:
            sent = [(CLOCK, Clock(t=now)), *sent]
        for topic, message in sent:
            self._listener(topic, message, now)  # type: ignore[arg-type]
            self._seq[topic.name] += 1
            number = self._seq[topic.name]
            for way in ("", *self._wire.apart(topic)):
                for extra, parcel in self._wire.carry(topic, number, message, now, way):  # type: ignore[arg-type]
                    self._fly(extra, topic, parcel, way)

    def _fly(self, extra: int, topic: Topic, parcel: Parcel, way: str = "") -> None:
        self._order += 1
        heapq.heappush(self._flying, (self.tick + 1 + extra, self._order, topic, parcel, way))

    def _deliver(self) -> None:
        while self._flying and self._flying[0][0] <= self.tick:
            _, _, topic, parcel, way = heapq.heappop(self._flying)
            apart = self._wire.apart(topic)
            for name, host in self.hosts.items():
                there = name == way if way else name not in apart
                if there and name not in self._dead and host.hears(topic):
                    host.arrives(topic, parcel)

    def _lives(self, name: str, acting: list[k.OnService]) -> bool:
        """Whether the service runs at this tick; one that died is replaced when it is due."""
        if any(isinstance(f, k.Death) for f in acting):
            if name not in self._dead:
                self._dead.add(name)
                self.refused += self.hosts[name].refused
            return False
        if name in self._dead:
            self._dead.discard(name)
            self.hosts[name] = Host(self._rebuild(name), self._clock_of(name))
        return not any(isinstance(f, k.Hang) for f in acting)

    def _clock_of(self, name: str) -> Callable[[], float]:
        """The local clock of a service's host [s]: any origin, and steps where there are faults."""
        steps = [f for f in self._faults if isinstance(f, k.ClockStep) and f.service == name]
        origin = 0.0 if name == ROBOT_PROCESS else 1000.0

        def local() -> float:
            off = sum(f.by for f in steps if f.active(self.now)) if steps else 0.0
            return origin + self.now + off

        return local
