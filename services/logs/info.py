"""What a log says of itself: where it comes from, what is in it, and whether it is whole."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from services.logs.file import BadLog, Record, records, whole_records
from services.logs.writer import ABOUT, ENDED, RECOVERED


@dataclass
class TopicInfo:
    """Messages of a topic.

    Attributes:
        name: of the topic.
        messages: how many.
        bytes: of JSON.
        first: arrival of the first [s], and ``last`` of the last.
    """

    name: str
    messages: int = 0
    bytes: int = 0
    first: float = 0.0
    last: float = 0.0

    @property
    def rate(self) -> float:
        """Messages a second [Hz]."""
        return (self.messages - 1) / (self.last - self.first) if self.last > self.first else 0.0


@dataclass
class LogInfo:
    """What there is to say of a log.

    Attributes:
        path: of the file.
        size: of it [bytes].
        whole: it was finished and can be read to its end.
        about: where it comes from.
        ended: what the recorder said at its end: messages heard, lost and refused.
        recovered: what it was recovered from; empty if it was not.
        topics: by name.
        why: it is not whole, in words.
    """

    path: Path
    size: int
    whole: bool = True
    about: dict[str, str] = field(default_factory=dict)
    ended: dict[str, str] = field(default_factory=dict)
    recovered: dict[str, str] = field(default_factory=dict)
    topics: list[TopicInfo] = field(default_factory=list)
    why: str = ""

    @property
    def start(self) -> float:
        """Arrival of the first message [s]."""
        return min((t.first for t in self.topics), default=0.0)

    @property
    def end(self) -> float:
        """Arrival of the last message [s]."""
        return max((t.last for t in self.topics), default=0.0)


def info_of(path: Path) -> LogInfo:
    """Look through a log; one that is cut short is read as far as it is whole.

    Raises:
        BadLog: it is no log of ours.
    """
    out = LogInfo(path, path.stat().st_size if path.is_file() else 0)
    topics: dict[str, TopicInfo] = {}
    try:
        _count(out, topics, whole_records(path))
    except BadLog as error:
        if not error.cut:
            raise
        topics.clear()
        out.whole, out.why = False, str(error)
        _count(out, topics, records(path))
    out.topics = sorted(topics.values(), key=lambda t: t.name)
    return out


def _count(out: LogInfo, topics: dict[str, TopicInfo], found: Iterable[Record]) -> None:
    kinds = {ABOUT: out.about, ENDED: out.ended, RECOVERED: out.recovered}
    for record in found:
        if record.metadata is not None:
            kinds.get(record.name, {}).update(record.metadata)
            continue
        topic = topics.get(record.name)
        if topic is None:
            topic = topics[record.name] = TopicInfo(record.name, first=record.time)
        topic.messages += 1
        topic.bytes += len(record.data)
        topic.last = record.time
