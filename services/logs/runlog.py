"""Logs: messages kept in memory, and as MCAP files of JSON with a schema per topic."""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from services.messages import BadMessage, Message, check
from services.topics import TOPICS, Topic

Series = dict[str, list[Message]]


class BadLog(ValueError):
    """A file that is no log of ours; the text names it."""


class LogWriter:
    """Writes messages to an MCAP file as they come; fast topics are thinned to their ``log_rate``.

    Times in the file are robot time, so two runs of one scenario and seed give the same bytes: a
    message's ``publish_time`` is the instant its content was true, its ``log_time`` the instant at
    which it was sent (lockstep) or heard (recorder).

    Args:
        path: of the file.
        metadata: where the log comes from; words only.
    """

    def __init__(self, path: Path, metadata: Mapping[str, str]) -> None:
        self.path = path
        self._stream = path.open("wb")
        # not compressed: the compressor's version must not change the bytes
        self._writer = Writer(self._stream, compression=CompressionType.NONE)
        self._writer.start(profile="", library="steadyhand")
        self._writer.add_metadata("steadyhand", dict(metadata))
        self._channels: dict[str, int] = {}
        self._due: dict[str, float] = {}
        self._count = 0

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def add(self, topic: Topic, message: Message, arrival: float) -> None:
        """Write one message, unless its topic is thinned and it is not its turn.

        Args:
            topic: of the message.
            message: to write.
            arrival: robot time at which it was sent or heard [s]; not before an earlier call's,
                for readers expect a file in the order of ``log_time``.
        """
        rate = TOPICS[topic.name].log_rate
        if rate:
            if message.t < self._due.get(topic.name, -np.inf) - 1e-9:
                return
            self._due[topic.name] = message.t + 1.0 / rate
        channel = self._channels.get(topic.name) or self._register(topic.name)
        body = json.dumps(plain(message), separators=(",", ":")).encode()
        log_time, publish_time = round(arrival * 1e9), round(message.t * 1e9)
        self._writer.add_message(channel, log_time, body, publish_time, self._count)
        self._count += 1

    def _register(self, name: str) -> int:
        schema = self._writer.register_schema(
            TOPICS[name].type.__name__, "jsonschema", json.dumps(json_schema(name)).encode()
        )
        self._channels[name] = self._writer.register_channel(name, "json", schema)
        return self._channels[name]

    def close(self) -> None:
        """Write the summary and close the file."""
        if not self._stream.closed:
            self._writer.finish()
            self._stream.close()


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
        """Write the log; returns the SHA-256 of the file, hexadecimal."""
        with LogWriter(path, metadata) as writer:
            for arrival, name, message in self._merged():
                writer.add(TOPICS[name], message, arrival)
        return hashlib.sha256(path.read_bytes()).hexdigest()

    def _merged(self) -> list[tuple[float, str, Message]]:
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


_MAGIC = b"\x89MCAP0\r\n"


def read_log(path: Path) -> tuple[RunLog, dict[str, str]]:
    """Read a log and its metadata.

    Raises:
        BadLog: not an MCAP file, cut short, or with messages that are not ours.
    """
    log = RunLog()
    metadata: dict[str, str] = {}
    try:
        with path.open("rb") as stream:
            reader = make_reader(stream)
            for record in reader.iter_metadata():
                if record.name == "steadyhand":
                    metadata = dict(record.metadata)
            for _, channel, record in reader.iter_messages():
                topic = TOPICS.get(channel.topic)
                if topic is None:
                    raise BadLog(f"{path}: topic {channel.topic!r} is not one of ours")
                content = json.loads(record.data)
                message = check(topic.type, _restored(topic, content))
                log(topic, message, record.log_time / 1e9)
    except FileNotFoundError:
        raise BadLog(f"{path}: no such file") from None
    except (McapError, BadMessage, json.JSONDecodeError, AssertionError) as error:
        why = "its recorder was killed before it finished the file" if _cut_short(path) else error
        raise BadLog(f"{path}: not a whole log of steadyhand: {why}") from error
    return log, metadata


def _cut_short(path: Path) -> bool:
    """Whether a file begins as an MCAP and does not end as one: both ends are the same bytes."""
    data = path.read_bytes()
    return data.startswith(_MAGIC) and not data[len(_MAGIC) :].endswith(_MAGIC)


def _restored(topic: Topic, content: dict[str, Any]) -> dict[str, Any]:
    """Turn the nulls that stand for what was not finite back into what is allowed."""
    for f in fields(topic.type):
        if content.get(f.name) is None and str(f.type) == "float":
            content[f.name] = f.metadata["spec"].hi
    return content


def plain(message: Message) -> dict[str, Any]:
    """A message as JSON-ready data; what is not finite becomes null."""
    out: dict[str, Any] = {}
    for f in fields(message):
        value = getattr(message, f.name)
        if isinstance(value, np.ndarray):
            value = value.tolist()
        elif isinstance(value, float) and not np.isfinite(value):
            value = None
        elif isinstance(value, dict):
            value = {k: _finite(v) for k, v in value.items()}
        out[f.name] = value
    return out


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value


_JSON = {"float": "number", "int": "integer", "str": "string", "bool": "boolean", "Array": "array"}


def json_schema(topic: str) -> dict[str, Any]:
    """JSON schema of a topic's messages."""
    properties: dict[str, Any] = {}
    for f in fields(TOPICS[topic].type):
        kind = str(f.type).split("[")[0]
        properties[f.name] = {"type": _JSON.get(kind, "array" if kind == "list" else "object")}
        spec = f.metadata.get("spec")
        if spec is not None:
            properties[f.name]["description"] = f"[{spec.unit}]"
    return {"type": "object", "properties": properties}
