"""Writes a log: an MCAP file of JSON with a schema per topic."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import orjson
from mcap.writer import Writer

from services.messages import Message
from services.topics import TOPICS, Topic

LIBRARY = "steadyhand"
ABOUT = "steadyhand"
"""Name of the metadata that say where a log comes from, ..."""
ENDED = "recorder"
"""... of those that the recorder writes at its end, ..."""
RECOVERED = "recovered"
"""... and of those of a log that was cut short and mended."""
CHUNK = 4 << 20
"""A chunk is written when it is so large, or when it is asked for [bytes]."""
_JSON = {
    "float": {"type": "number"},
    "int": {"type": "integer"},
    "str": {"type": "string"},
    "bool": {"type": "boolean"},
}


class LogWriter:
    """Writes messages to an MCAP file as they come.

    Times in the file are robot time, so two runs of one scenario and seed give the same bytes: a
    message's ``publish_time`` is the instant its content was true, its ``log_time`` the instant at
    which it was sent (lockstep) or heard (recorder).

    Args:
        path: of the file.
        metadata: where the log comes from; words only.
        record: ``full`` keeps every message; ``light`` thins fast topics to their ``light_rate``.
    """

    def __init__(self, path: Path, metadata: Mapping[str, str], record: str = "full") -> None:
        self.path = path
        self._light = record == "light"
        self._stream = path.open("wb")
        self._writer = Writer(self._stream, chunk_size=CHUNK)
        self._writer.start(profile="", library=LIBRARY)
        self._writer.add_metadata(ABOUT, dict(metadata))
        self._stream.flush()
        self._channels: dict[str, int] = {}
        self._due: dict[str, float] = {}
        self._count = 0
        self._digest = hashlib.sha256()

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """After an error there is no file: cut short, it would look whole."""
        if kind is None:
            self.close()
        else:
            self.give_up()
            self.path.unlink(missing_ok=True)

    @property
    def digest(self) -> str:
        """SHA-256 of the messages so far with their topics and times, hexadecimal.

        Not of the file: where it comes from, and which compressor made it, do not matter.
        """
        return self._digest.hexdigest()

    def add(self, topic: Topic, message: Message, arrival: float) -> None:
        """Write one message, unless its topic is thinned and it is not its turn.

        Args:
            topic: of the message.
            message: to write.
            arrival: robot time at which it was sent or heard [s]; not before an earlier call's,
                for readers expect a file in the order of ``log_time``.
        """
        if self._light and not self._turn(topic, message.t):
            return
        body = orjson.dumps(message, default=_plain, option=orjson.OPT_SERIALIZE_NUMPY)
        self.copy(topic.name, body, message.t, arrival)

    def copy(self, name: str, body: bytes, stamp: float, arrival: float) -> None:
        """Write one message that is JSON already.

        Args:
            name: of its topic.
            body: JSON.
            stamp: instant at which its content was true [s].
            arrival: as in ``add`` [s].
        """
        channel = self._channels.get(name) or self._register(name)
        log_time, publish_time = round(arrival * 1e9), round(stamp * 1e9)
        self._writer.add_message(channel, log_time, body, publish_time, self._count)
        self._digest.update(f"{name} {log_time} {publish_time} {len(body)}\n".encode())
        self._digest.update(body)
        self._count += 1

    def _turn(self, topic: Topic, t: float) -> bool:
        rate = TOPICS[topic.name].light_rate
        if not rate:
            return True
        due = self._due.get(topic.name, -np.inf)
        if due - 1.0 / rate <= t < due - 1e-9:  # before that: the robot was restarted
            return False
        self._due[topic.name] = t + 1.0 / rate
        return True

    def _register(self, name: str) -> int:
        schema = self._writer.register_schema(
            TOPICS[name].type.__name__, "jsonschema", orjson.dumps(json_schema(name))
        )
        self._channels[name] = self._writer.register_channel(name, "json", schema)
        return self._channels[name]

    def note(self, name: str, metadata: Mapping[str, str]) -> None:
        """Write further metadata; words only."""
        self._writer.add_metadata(name, dict(metadata))

    def flush(self) -> None:
        """Hand all that was added to the operating system: from here on a kill cannot cut it."""
        self._writer.flush()

    def give_up(self) -> None:
        """Close the file as it is, where it cannot be written any more: a log that is cut short."""
        with suppress(OSError):
            self._stream.close()

    def close(self) -> None:
        """Write the summary and close the file."""
        if not self._stream.closed:
            self._writer.finish()
            self._stream.close()


def _plain(value: Any) -> Any:
    """What orjson does not take as it is: arrays that are views across others."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot go into a log")


def json_schema(topic: str) -> dict[str, Any]:
    """JSON schema of a topic's messages; the description of a field is its unit."""
    properties: dict[str, Any] = {}
    for f in fields(TOPICS[topic].type):
        spec = f.metadata.get("spec")
        kind = _kind(str(f.type), len(spec.shape) if spec is not None and spec.shape else 0)
        properties[f.name] = kind | ({"description": f"[{spec.unit}]"} if spec is not None else {})
    return {"title": TOPICS[topic].type.__name__, "type": "object", "properties": properties}


def _kind(name: str, dimensions: int) -> dict[str, Any]:
    """Schema of a field from its annotation; arrays of so many dimensions."""
    if dimensions:
        return {"type": "array", "items": _kind("float", dimensions - 1)}
    if name.startswith("list["):
        return {"type": "array", "items": _kind(name[5:-1], 0)}
    if name.startswith("dict["):
        inside = _kind(name[:-1].split(", ", 1)[1], 0)
        return {"type": "object", "additionalProperties": inside}
    return dict(_JSON[name])
