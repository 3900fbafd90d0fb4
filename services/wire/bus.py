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
from services.wire.codec import decode, encode
from services.wire.endpoints import Endpoints, config

RING = 8  # payloads kept of a latest-value topic: some may be bad, the newest good one is used
PATIENCE = 0.5  # [s]; beyond its age limit a message is taken as a backlog and refused
ROBOT = "sim"
JUMP = 60.0  # [s]; a restarted robot is not further ahead than this
FUTURE = 0.5  # [s]; a message this far ahead of us is not from our robot's time

Clock = Callable[[], float]
M = TypeVar("M", bound=Message)


class _Reader:
    """One subscribed topic: its slot, and what was last accepted from it."""

    def __init__(self, topic: Topic, lossless: bool) -> None:
        self.topic = topic
        size = None if lossless else max(topic.depth, RING)
        self.slot: deque[tuple[bytes, float]] = deque(maxlen=size)
        """Payloads, and when they arrived by the local clock [s]."""
        self.seq = -1
        self.t = -1.0
        self.accepted_at = -float("inf")


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
                options |= {"express": True, "priority": zenoh.Priority.REAL_TIME}
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
        topic = reader.topic
        try:
            seq, message = decode(topic, payload)
            if not self.lossless:
                self._check_order(reader, seq, message, now)
        except BadMessage as error:
            self.refused[f"{topic.name}: {error.reason}"] += 1
            return None
        if topic.depth > 1 and 0 <= reader.seq < seq - 1 < reader.seq + 10_000:
            self.lost[topic.name] += seq - 1 - reader.seq
        reader.seq, reader.t, reader.accepted_at = seq, message.t, self._clock()
        return message

    def _check_order(self, reader: _Reader, seq: int, message: Message, now: float | None) -> None:
        topic = reader.topic
        silent = self._clock() - reader.accepted_at > topic.age_limit
        if now is not None and now - message.t > topic.age_limit + PATIENCE:
            raise BadMessage("old", f"{now - message.t:.3f} s")
        # only the robot itself may jump ahead: restarted, it tells a time of its own
        ahead = JUMP if silent and topic.owner == ROBOT else FUTURE
        if now is not None and message.t - now > ahead:
            raise BadMessage("future", f"{message.t - now:.3f} s")
        if silent:  # nothing to compare with: the owner is new, or was restarted
            return
        if seq == reader.seq:
            raise BadMessage("duplicate", str(seq))
        if topic.depth == 1 and message.t <= reader.t:
            raise BadMessage("stale", f"{message.t} after {reader.t}")
        if topic.depth > 1 and seq < reader.seq:
            raise BadMessage("stale", f"number {seq} after {reader.seq}")

    def take(self, topic: Topic[M]) -> list[tuple[int, M]]:
        """All good messages of a topic with their numbers, in order (lossless)."""
        reader = self._readers[topic.name]
        out: list[tuple[int, M]] = []
        while reader.slot:
            message = self._accept(reader, reader.slot.popleft()[0], None)
            if message is not None:
                out.append((reader.seq, message))  # type: ignore[arg-type]
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
