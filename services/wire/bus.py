"""The bus: typed topics over Zenoh, checked on arrival, never raising into a loop.

Zenoh's threads only copy payloads into slots. Decoding, checking and counting happen in the
loop's own thread, in ``drain``.
"""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import zenoh

from services.messages import BadMessage, Message
from services.service import Inbox
from services.topics import Topic, key
from services.wire.admission import Admission
from services.wire.codec import encode
from services.wire.endpoints import Endpoints, config

RING = 8  # payloads kept of a latest-value topic: some may be bad, the newest good one is used

Clock = Callable[[], float]
M = TypeVar("M", bound=Message)


class _Reader:
    """One subscribed topic: its slot, and who judges what is in it."""

    def __init__(self, topic: Topic, lossless: bool) -> None:
        self.topic = topic
        size = None if lossless else max(topic.depth, RING)
        self.slot: deque[tuple[bytes, float]] = deque(maxlen=size)
        """Payloads, and when they arrived by the local clock [s]."""
        self.admission = Admission(topic)


class Bus:
    """What one service says and hears. Made by ``open_bus``.

    Args:
        session: open Zenoh session.
        robot: name of the robot, the first part of every key.
        service: name of this service, the owner of what it publishes.
        inputs: topics to hear.
        lossless: queue everything, block rather than drop, and judge no message's age.
        clock: local time for noticing silence [s].
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        service: str,
        inputs: Iterable[Topic] = (),
        lossless: bool = False,
        clock: Clock = time.monotonic,
    ) -> None:
        self.session = session
        self.robot = robot
        self.service = service
        self.lossless = lossless
        self.refused: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        """Gaps in sequence numbers of topics that are read in full."""
        self.arrived = threading.Event()
        """Set whenever a message arrives on a topic passed to ``wake_on``."""
        self.arrived_at = 0.0
        self._wake: set[str] = set()
        self._clock = clock
        self._readers: dict[str, _Reader] = {}
        self._publishers: dict[str, zenoh.Publisher] = {}
        # a restarted service goes on counting above where it was, without remembering it
        self._first_seq = 0 if lossless else time.monotonic_ns() // 1000
        self.sent: dict[str, int] = {}
        self._subscribers: dict[str, Any] = {}
        for topic in inputs:
            self.hear(topic)

    def hear(self, topic: Topic) -> None:
        """Subscribe to a topic (before the loop goes live)."""
        if topic.name in self._readers:
            return
        reader = self._readers[topic.name] = _Reader(topic, self.lossless)
        slot, name, wake, arrived = reader.slot, topic.name, self._wake, self.arrived

        def copy(sample: zenoh.Sample) -> None:
            try:
                at = time.monotonic()
                slot.append((sample.payload.to_bytes(), at))
                if name in wake:
                    self.arrived_at = at
                    arrived.set()
            except Exception:  # zenoh would only log it
                self.refused[f"{name}: callback"] += 1

        handler = zenoh.handlers.Callback(copy, indirect=False)
        self._subscribers[name] = self.session.declare_subscriber(key(self.robot, topic), handler)

    def forget(self, topic: Topic) -> None:
        """Stop hearing a topic."""
        if self._readers.pop(topic.name, None) is not None:
            self._subscribers.pop(topic.name).undeclare()

    def wake_on(self, *topics: Topic) -> None:
        """Let arrivals on these topics set ``arrived``."""
        self._wake.update(topic.name for topic in topics)

    def publish(self, topic: Topic, message: Message) -> int:
        """Send a message; returns its sequence number.

        Raises:
            ValueError: the topic belongs to another service, or takes another message.
        """
        publisher = self._publishers.get(topic.name) or self._declare(topic)
        if type(message) is not topic.type:
            raise ValueError(f"{topic.name} takes {topic.type.__name__}, not {message!r}")
        seq = self.sent.get(topic.name, self._first_seq - 1) + 1
        self.sent[topic.name] = seq
        publisher.put(encode(self.service, seq, message))
        return seq

    def _declare(self, topic: Topic) -> zenoh.Publisher:
        if topic.owner != self.service:
            raise ValueError(f"{topic.name} is {topic.owner}'s; {self.service} may not publish it")
        options: dict[str, Any] = {"reliability": zenoh.Reliability.RELIABLE}
        if self.lossless:
            options |= {"congestion_control": zenoh.CongestionControl.BLOCK, "express": True}
        else:
            options["congestion_control"] = zenoh.CongestionControl.DROP
            if topic.control:
                # not express: each message would take one of 16 batches, and a reader that is not
                # served for some ms, above all the recorder, would lose what comes after
                options |= {"priority": zenoh.Priority.REAL_TIME}
                if topic.depth == 1:  # the next one is worth more than this one sent again
                    options["reliability"] = zenoh.Reliability.BEST_EFFORT
        publisher = self.session.declare_publisher(key(self.robot, topic), **options)
        self._publishers[topic.name] = publisher
        return publisher

    def declare(self, *topics: Topic) -> None:
        """Declare publishers ahead of the loop, so that its first tick is like any other."""
        for topic in topics:
            if topic.name not in self._publishers:
                self._declare(topic)

    def drain(self, inbox: Inbox, now: float | None) -> list[tuple[Topic, Message, float]]:
        """Move what arrived and passes every check into the inbox; count the rest.

        Args:
            inbox: of this service.
            now: robot time [s]; None as long as it is not known: no age is judged then.

        Returns:
            What was accepted, with the local time of its arrival [s]; in order of arrival per
            topic. It never raises.
        """
        accepted: list[tuple[Topic, Message, float]] = []
        for reader in self._readers.values():
            if not reader.slot:
                continue
            newest = self._newest if reader.topic.depth == 1 else self._all
            for message, at in newest(reader, now):
                inbox.offer(reader.topic, message, at)
                accepted.append((reader.topic, message, at))
        return accepted

    def _newest(self, reader: _Reader, now: float | None) -> list[tuple[Message, float]]:
        """The newest good message of a latest-value topic; older ones are not even decoded."""
        slot, batch = reader.slot, []
        while slot:
            batch.append(slot.popleft())
        for payload, at in reversed(batch):
            message = self._accept(reader, payload, now)
            if message is not None:
                return [(message, at)]
        return []

    def _all(self, reader: _Reader, now: float | None) -> list[tuple[Message, float]]:
        slot, out = reader.slot, []
        while slot:
            payload, at = slot.popleft()
            message = self._accept(reader, payload, now)
            if message is not None:
                out.append((message, at))
        return out

    def _accept(self, reader: _Reader, payload: bytes, now: float | None) -> Message | None:
        name, admission = reader.topic.name, reader.admission
        try:
            message = admission.accept(payload, now, self._clock(), not self.lossless)
        except BadMessage as error:
            self.refused[f"{name}: {error.reason}"] += 1
            return None
        if admission.gap > 0:
            self.lost[name] += admission.gap
        return message

    def take(self, topic: Topic[M]) -> list[tuple[int, M]]:
        """All good messages of a topic with their numbers, in order (lossless)."""
        reader = self._readers[topic.name]
        out: list[tuple[int, M]] = []
        while reader.slot:
            message = self._accept(reader, reader.slot.popleft()[0], None)
            if message is not None:
                out.append((reader.admission.seq, message))  # type: ignore[arg-type]
        return out


@contextmanager
def open_bus(
    endpoints: Endpoints,
    robot: str,
    service: str,
    inputs: Iterable[Topic] = (),
    lossless: bool = False,
    clock: Clock = time.monotonic,
) -> Iterator[Bus]:
    """A bus on a session of its own, closed at the end whatever happens.

    Raises:
        BadEndpoint: an endpoint beyond this machine.
    """
    with zenoh.open(config(endpoints)) as session:
        yield Bus(session, robot, service, inputs, lossless, clock)
