"""What becomes of a message on a wire with faults: when it arrives, and as what."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from services.faults import kinds as k
from services.lockstep import TICK
from services.messages import Message
from services.topics import TOPICS, Topic
from services.wire.codec import encode

MEMORY = 3000
"""Messages of a topic that a replay can choose from."""
STRAY = "stranger"


class Parcel(NamedTuple):
    """A message on its way: as it was sent, or as bytes if it was tampered with."""

    seq: int
    message: Message | None
    payload: bytes | None = None


class FaultyWire:
    """Applies the faults of topics.

    Args:
        faults: all of them; those of services are left alone.
        rng: for what is lost, late or changed.
    """

    def __init__(self, faults: Sequence[k.Fault], rng: np.random.Generator) -> None:
        self._faults = [f for f in faults if isinstance(f, k.OnTopic)]
        self._rng = rng
        self._of: dict[str, list[k.OnTopic]] = {}
        self._apart: dict[str, tuple[str, ...]] = {}
        for fault in self._faults:
            self._of.setdefault(fault.topic, []).append(fault)
        for name, faults_of in self._of.items():
            self._apart[name] = tuple(sorted({f.reader for f in faults_of if f.reader}))
        self._last: dict[str, Message] = {}
        self._sent: dict[str, deque[tuple[float, Parcel]]] = {
            f.topic: deque(maxlen=MEMORY) for f in self._faults if isinstance(f, k.Replay)
        }

    def apart(self, topic: Topic) -> tuple[str, ...]:
        """Services on whose way alone a topic has faults: theirs is another way."""
        return self._apart.get(topic.name, ())

    def carry(
        self, topic: Topic, seq: int, message: Message, now: float, reader: str = ""
    ) -> list[tuple[int, Parcel]]:
        """Extra ticks and parcel of everything that arrives of one message.

        Args:
            topic: of the message.
            seq: its number.
            message: as it was sent.
            now: robot time [s].
            reader: one of ``apart`` to whom it is on its way; the others if empty.
        """
        parcel = Parcel(seq, message)
        self._last[topic.name] = message
        memory = self._sent.get(topic.name)
        if memory is not None:
            memory.append((now, parcel))
        out = [(0, parcel)]
        for fault in self._of.get(topic.name, ()):
            if fault.reader in ("", reader) and fault.active(now):
                out = [
                    each for ticks, p in out for each in self._apply(fault, topic, ticks, p, now)
                ]
        return out

    def stray(self, now: float) -> Iterator[tuple[Topic, Parcel]]:
        """What a stranger sends at this tick."""
        for fault in self._faults:
            if not isinstance(fault, k.Flood) or not fault.active(now):
                continue
            topic = TOPICS[fault.topic]
            for number in range(fault.count):
                if number % 2:
                    noise = self._rng.bytes(int(self._rng.integers(1, 400)))
                    yield topic, Parcel(0, None, noise)
                else:
                    yield topic, Parcel(0, None, self._forged(topic, now))

    def _apply(
        self, fault: k.Fault, topic: Topic, ticks: int, parcel: Parcel, now: float
    ) -> list[tuple[int, Parcel]]:
        rng = self._rng
        match fault:
            case k.Loss():
                return [] if rng.random() < fault.share else [(ticks, parcel)]
            case k.Duplication():
                again = (ticks + int(rng.integers(0, 20)), parcel)
                return [(ticks, parcel), again] if rng.random() < fault.share else [(ticks, parcel)]
            case k.Reordering():
                return [(ticks + round(rng.random() * fault.spread / TICK), parcel)]
            case k.Lateness():
                return [(ticks + round(fault.extra / TICK), parcel)]
            case k.Replay():
                old = next((p for t, p in self._sent[topic.name] if t >= now - fault.back), parcel)
                return [(ticks, parcel), (ticks, old)]
            case k.Corruption() if parcel.message is not None and rng.random() < fault.share:
                return [(ticks, Parcel(parcel.seq, None, self._corrupted(topic, parcel)))]
        return [(ticks, parcel)]

    def _forged(self, topic: Topic, now: float) -> bytes:
        """Well formed, under the stranger's own name."""
        number = int(self._rng.integers(1 << 40))
        last = self._last.get(topic.name)
        return encode(STRAY, number, replace(last, t=now)) if last is not None else b""

    def _corrupted(self, topic: Topic, parcel: Parcel) -> bytes:
        assert parcel.message is not None
        payload = bytearray(encode(topic.owner, parcel.seq, parcel.message))
        for _ in range(int(self._rng.integers(1, 6))):
            payload[int(self._rng.integers(len(payload)))] = int(self._rng.integers(256))
        return bytes(payload[: int(self._rng.integers(1, len(payload) + 1))])
