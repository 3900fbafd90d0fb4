"""A run's messages in memory; written to a log and read back."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import orjson

from services.logs.file import BadLog, Record, records, whole_records
from services.logs.writer import ABOUT, ENDED, LogWriter
from services.messages import BadMessage, Message, check
from services.topics import TOPICS, Topic

__all__ = ["BadLog", "RunLog", "Series", "read_log", "read_run"]

Series = dict[str, list[Message]]


class RunLog:
    """Messages of a run by topic, in memory; a listener for the lockstep runner."""

    def __init__(self) -> None:
        self.messages: Series = defaultdict(list)
        self._arrivals: dict[str, list[float]] = defaultdict(list)

    def __call__(self, topic: Topic, message: Message, arrival: float | None = None) -> None:
        """Keep one message.

        Args:
            topic: of the message.
            message: to keep.
            arrival: robot time at which it was sent or heard [s]; its stamp if not known.
        """
        self.messages[topic.name].append(message)
        self._arrivals[topic.name].append(message.t if arrival is None else arrival)

    def series(self, topic: Topic) -> list[Any]:
        """All messages of a topic, in order of arrival."""
        return self.messages.get(topic.name, [])

    def arrivals(self, topic: Topic) -> list[float]:
        """Robot time at which each message of a topic was sent or heard [s]."""
        return self._arrivals.get(topic.name, [])

    def write(self, path: Path, metadata: Mapping[str, str]) -> str:
        """Write the log, light if the metadata say so.

        Returns:
            SHA-256 of what was written, see ``LogWriter.digest``.
        """
        with LogWriter(path, metadata, metadata.get("record", "full")) as writer:
            for arrival, name, message in self.merged():
                writer.add(TOPICS[name], message, arrival)
        return writer.digest

    def merged(self) -> list[tuple[float, str, Message]]:
        """All messages with arrival and topic, by arrival; those of one instant by topic."""
        everything = [
            (arrival, name, message)
            for name in sorted(self.messages)
            for arrival, message in zip(
                self._arrivals.get(name, []), self.messages[name], strict=True
            )
        ]
        everything.sort(key=lambda item: item[0])
        return everything


def read_log(path: Path, topics: Iterable[Topic] | None = None) -> tuple[RunLog, dict[str, str]]:
    """Read a whole log and its metadata.

    Args:
        path: of the file.
        topics: to read; all if not given.

    Raises:
        BadLog: no log of ours, cut short, or with messages that are not ours; the text says how
            to go on.
    """
    log = RunLog()
    about = _fill(log, path, whole_records(path, _names(topics)), [])
    return log, about


def read_run(
    path: Path, topics: Iterable[Topic] | None = None
) -> tuple[RunLog, dict[str, str], list[str]]:
    """Read a log, or all that is in a run's folder: one log, or those of a recorder that died.

    A recorder that is killed leaves a log that is cut, and its successor goes on in another file
    (``run.mcap``, ``run-2.mcap``). In a folder cut logs are read as far as they are whole.

    Returns:
        The messages, metadata, and what people should know of the files, in words.

    Raises:
        BadLog: nothing there that can be read, or a file that is no whole log.
    """
    log, about, notes = RunLog(), dict[str, str](), list[str]()
    names = _names(topics)
    if not path.is_dir():
        about = _fill(log, path, whole_records(path, names), notes)
        return log, about, notes
    parts = parts_of(path)
    for part in parts:
        try:
            found = _fill(log, part, whole_records(part, names), notes)
        except BadLog as cut:
            if not cut.cut:
                raise
            found = _fill(log, part, records(part, names, notes), notes)
        about = about or found
    if not about:
        raise BadLog(f"{path}: nothing in {', '.join(p.name for p in parts)} can be read")
    if len(parts) > 1:
        notes.append(f"read from {len(parts)} files: the recorder was restarted")
    return log, about, notes


def parts_of(folder: Path) -> list[Path]:
    """The log of a run in its folder; several files if its recorder was restarted, in order.

    Raises:
        BadLog: none, or logs of different runs; the text names them.
    """
    inside = sorted(p for p in folder.glob("*.mcap") if not p.stem.endswith("-recovered"))
    inside = inside or sorted(folder.glob("*.mcap"))
    if not inside:
        raise BadLog(f"{folder}: a folder without a log (no *.mcap in it)")
    first = min(inside, key=lambda p: len(p.stem))

    def number(path: Path) -> int:
        """Which of the recorder's files it is; 0 if it is none of this run's."""
        rest = path.stem.removeprefix(f"{first.stem}-")
        return 1 if path == first else int(rest) if rest.isdigit() else 0

    if not all(map(number, inside)):
        names = ", ".join(p.name for p in inside)
        raise BadLog(f"{folder}: has several logs, name one of them: {names}")
    return sorted(inside, key=number)


def _names(topics: Iterable[Topic] | None) -> set[str] | None:
    return None if topics is None else {topic.name for topic in topics}


def _fill(log: RunLog, path: Path, found: Iterable[Record], notes: list[str]) -> dict[str, str]:
    """Put messages into a log, and what was lost into the notes; returns where they come from."""
    about: dict[str, str] = {}
    for record in found:
        if record.metadata is not None:
            if record.name == ABOUT:
                about = record.metadata
            elif record.name == ENDED and record.metadata.get("lost", "0") != "0":
                notes.append(f"the recorder lost {record.metadata['lost']} messages")
            continue
        topic = TOPICS.get(record.name)
        if topic is None:
            raise BadLog(f"{path}: topic {record.name!r} is not one of ours")
        try:
            message = check(topic.type, _restored(topic, orjson.loads(record.data)))
        except (BadMessage, orjson.JSONDecodeError) as error:
            raise BadLog(
                f"{path}: a message on {record.name} that is not ours, {record.time:.3f} s:"
                f" {error}; of another version? The log's versions: steadyhand log info {path}"
            ) from None
        log(topic, message, record.time)
    return about


def _restored(topic: Topic, content: dict[str, Any]) -> dict[str, Any]:
    """What a log leaves open: a null stands for what was not finite; a field that is missing was
    added to the message since, and has its default."""
    for f in fields(topic.type):
        if f.name not in content:
            if f.default_factory is not MISSING:
                content[f.name] = f.default_factory()
            elif f.default is not MISSING:
                content[f.name] = f.default
        elif content[f.name] is None and str(f.type) == "float":
            content[f.name] = f.metadata["spec"].hi
    return content
