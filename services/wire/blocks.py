"""Messages of fast topics, sent once more in blocks, for a reader that wants all and none at once.

Every message wakes its reader, and takes its sender a write to that reader's socket: at 2500 a
second this costs the loops of a small machine more than all that the recorder does with them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import msgpack
import zenoh

from services.messages import BadMessage
from services.topics import Topic, block_key

BLOCK = 0.02
"""The oldest message of a block waits about so long [s]: what is lost of a process that is
killed. It is sent with the first message of any topic after that."""
MOST = 256
"""Messages in a block."""
OLDEST = 60.0
"""No message of a block waited longer [s]."""


class Blocks:
    """What a process says on fast topics, collected.

    Args:
        session: open Zenoh session.
        robot: first part of every key.
        clock: local time [s].
    """

    def __init__(
        self, session: zenoh.Session, robot: str, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._session, self._robot, self._clock = session, robot, clock
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._waiting: dict[str, list[tuple[float, bytes]]] = {}
        self._count = 0
        self._oldest = 0.0

    def add(self, topic: Topic, payload: bytes) -> None:
        """Take in what was just sent; send what has waited long enough, of all topics."""
        now = self._clock()
        if topic.in_blocks:
            if topic.name not in self._publishers:
                self._declare(topic)
            self._oldest = self._oldest if self._count else now
            self._waiting[topic.name].append((now, payload))
            self._count += 1
        if self._count and (now - self._oldest >= BLOCK or self._count >= MOST):
            self.flush()

    def flush(self) -> None:
        """Send what waits."""
        now = self._clock()
        for name, waiting in self._waiting.items():
            if waiting:
                self._publishers[name].put(pack(waiting, now))
                waiting.clear()
        self._count = 0

    def _declare(self, topic: Topic) -> None:
        self._waiting[topic.name] = []
        self._publishers[topic.name] = self._session.declare_publisher(
            block_key(self._robot, topic),
            congestion_control=zenoh.CongestionControl.DROP,
            reliability=zenoh.Reliability.RELIABLE,
        )


def pack(messages: list[tuple[float, bytes]], now: float) -> bytes:
    """A block of payloads, each with how long before ``now`` it was sent [s]."""
    return msgpack.packb([[now - at, payload] for at, payload in messages])


def unpack(block: bytes, at: float, after: float = -math.inf) -> list[tuple[bytes, float]]:
    """Payloads of a block that arrived ``at`` [s], each with when it would have arrived alone.

    Args:
        block: as it came.
        at: when [s].
        after: when the last message of the block before it would have; none of this one's did
            before, however late that block was [s].

    Raises:
        BadMessage: with reason ``block``, whatever the bytes are.
    """
    try:
        entries = [(payload, max(at - ago, after)) for ago, payload in msgpack.unpackb(block)]
    except Exception as error:
        raise BadMessage("block", repr(error)) from error
    if len(entries) > MOST:
        raise BadMessage("block", f"{len(entries)} messages")
    for payload, sent in entries:
        if not isinstance(payload, bytes) or not 0.0 <= at - sent <= OLDEST:
            raise BadMessage("block", "not payloads with their ages")
    return entries
