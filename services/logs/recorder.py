"""The recorder: hears every topic and writes the log, in a process of its own."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from services.logs.writer import ENDED, LogWriter
from services.messages import Message
from services.service import Inbox, Outbox, Reply
from services.topics import RECORDER, TOPICS, Topic

DEPTH = 20_000
"""Messages of a topic that may wait between two steps: some seconds of the fastest."""
FLUSH = 10
"""Steps between two writes to the file: a recorder that is killed loses half a second, and what
waited for two steps."""


class Recorder:
    """Writes all that is said on the bus; nobody waits for it.

    Args:
        path: of the log.
        metadata: where the log comes from; ``record`` in it says whether it is full or light.
    """

    name = RECORDER
    period = 0.05
    verbs: tuple[str, ...] = ()

    def __init__(self, path: Path, metadata: Mapping[str, str]) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._writer = LogWriter(path, metadata, metadata.get("record", "full"))
        self._steps = 0
        self._count = 0
        self._flushed = 0
        self._problem = ""
        self._time = 0.0
        self._waiting: list[tuple[float, Topic, Message]] = []
        self._until = -float("inf")
        self.inputs: tuple[Topic, ...] = tuple(
            replace(topic, depth=DEPTH)
            for topic in TOPICS.values()
            if not topic.name.endswith("/tick")
        )

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Write what arrived until the step before; says nothing itself.

        A message arrived when robot time had come as far as the newest stamp heard until then: the
        arm's state says it every millisecond. That holds at whatever pace robot time runs, and our
        own steps, which are 50 ms apart, do not matter. Topics are emptied one after the other
        while others go on arriving; only what is older than the last step is surely complete.
        """
        heard = inbox.heard()
        self._waiting += heard
        self._waiting.sort(key=lambda item: item[0])  # stable
        complete = bisect_right(self._waiting, self._until, key=lambda item: item[0])
        self._until = max((at for at, _, _ in heard), default=self._until)
        self._steps += 1
        with self._unless_full():
            self._take_in(complete)
            if self._steps % FLUSH == 0 and not self._problem:
                self._writer.flush()
                self._flushed = self._count
        del self._waiting[:complete]
        return []

    def _take_in(self, count: int) -> None:
        """Count the first of those that wait, and write them as long as the disk takes them."""
        self._count += count
        for _, topic, message in self._waiting[: 0 if self._problem else count]:
            self._time = max(self._time, message.t)
            self._writer.add(topic, message, self._time)

    @contextmanager
    def _unless_full(self) -> Iterator[None]:
        """A disk that takes no more ends the log, not the recorder: what is written is kept."""
        try:
            yield
        except OSError as error:
            self._problem = f"{error.strerror or error} at {self._time:.1f} s"
            self._writer.give_up()

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """The recorder answers no requests."""
        raise ValueError(f"the recorder does not answer {verb!r}")

    def state(self) -> tuple[str, str]:
        """Recording, and how much so far, or why it does so no longer."""
        if self._problem:
            left_out = self._count - self._flushed
            return "stopped", f"{self._problem}; log {self._writer.path} lacks {left_out} messages"
        return "recording", f"{self._count} messages heard, log {self._writer.path}"

    def close(self, lost: Mapping[str, int], refused: Mapping[str, int]) -> None:
        """Write what is left, what did not come, and finish the file, if there is room for it.

        Args:
            lost: messages that were sent and not heard, by topic.
            refused: messages that could not be read, by topic and reason.
        """
        with self._unless_full():
            self._finish(lost, refused)

    def _finish(self, lost: Mapping[str, int], refused: Mapping[str, int]) -> None:
        self._take_in(len(self._waiting))
        if self._problem:
            return
        counts = {
            "heard": self._count,
            "lost": sum(lost.values()),
            "refused": sum(refused.values()),
        }
        words = {name: str(count) for name, count in counts.items()}
        words |= {f"lost {name}": str(n) for name, n in lost.items()}
        words |= {f"refused {name}": str(n) for name, n in refused.items()}
        self._writer.note(ENDED, words)
        self._writer.close()


def free_name(path: Path) -> Path:
    """``path``, or with a number if a recorder that died has left a file there."""
    number, free = 1, path
    while free.exists():
        number += 1
        free = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return free
