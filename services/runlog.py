"""Keeps what a run said, and writes it as an MCAP file of JSON with a schema per topic."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer

from services.messages import Message
from services.topics import TOPICS, Topic

Series = dict[str, list[Message]]


class RunLog:
    """Collects messages by topic in memory; a listener for the lockstep runner."""

    def __init__(self) -> None:
        self.messages: Series = {}

    def __call__(self, topic: Topic, message: Message) -> None:
        """Keep one message."""
        self.messages.setdefault(topic.name, []).append(message)

    def series(self, topic: Topic) -> list[Any]:
        """All messages of a topic, in order."""
        return self.messages.get(topic.name, [])

    def write(self, path: Path, metadata: Mapping[str, str]) -> str:
        """Write the log; fast topics are thinned to their ``log_rate``.

        Times in the file are robot time, so two runs of one scenario and seed give the same bytes.

        Returns:
            SHA-256 of the file, hexadecimal.
        """
        with path.open("wb") as stream:
            # not compressed: the compressor's version must not change the digest
            writer = Writer(stream, compression=CompressionType.NONE)
            writer.start(profile="", library="steadyhand")
            writer.add_metadata("steadyhand", dict(metadata))
            channels = {}
            for name in sorted(self.messages):
                schema = writer.register_schema(
                    TOPICS[name].type.__name__, "jsonschema", json.dumps(json_schema(name)).encode()
                )
                channels[name] = writer.register_channel(name, "json", schema)
            for sequence, (name, message) in enumerate(self._merged()):
                stamp = round(message.t * 1e9)
                body = json.dumps(plain(message), separators=(",", ":")).encode()
                writer.add_message(channels[name], stamp, body, stamp, sequence)
            writer.finish()
        return hashlib.sha256(path.read_bytes()).hexdigest()

    def _merged(self) -> Iterator[tuple[str, Message]]:
        kept = []
        for name in sorted(self.messages):
            due = -np.inf
            gap = 1.0 / TOPICS[name].log_rate if TOPICS[name].log_rate else 0.0
            for message in self.messages[name]:
                if message.t >= due - 1e-9:
                    due = message.t + gap
                    kept.append((message.t, name, message))
        kept.sort(key=lambda item: item[0])
        return ((name, message) for _, name, message in kept)


def plain(message: Message) -> dict[str, Any]:
    """A message as JSON-ready data; what is not finite becomes null."""
    out: dict[str, Any] = {}
    for f in fields(message):
        value = getattr(message, f.name)
        if isinstance(value, np.ndarray):
            value = value.tolist()
        elif isinstance(value, float) and not np.isfinite(value):
            value = None
        out[f.name] = value
    return out


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
