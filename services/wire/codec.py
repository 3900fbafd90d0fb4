"""The wire form of a message: MessagePack, checked on arrival."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import msgpack
import numpy as np

from services.messages import BadMessage, Message, check
from services.topics import TOPICS, Topic
from services.wire.endpoints import LARGEST

_LAST_SEQ = 1 << 62


_NAMES = {topic.type: tuple(f.name for f in fields(topic.type)) for topic in TOPICS.values()}


def _plain(value: Any) -> Any:
    """Plain data for what MessagePack does not know: arrays and numpy scalars."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot go on the wire")


def encode(service: str, seq: int, message: Message) -> bytes:
    """Bytes of ``message`` as sent by ``service`` with sequence number ``seq``."""
    body = {name: getattr(message, name) for name in _NAMES[type(message)]}
    return msgpack.packb({"from": service, "seq": seq, "body": body}, default=_plain)


def decode(topic: Topic, payload: bytes) -> tuple[int, Message]:
    """Sequence number and message, or a refusal.

    Raises:
        BadMessage: with reason ``size``, ``truncated``, ``undecodable``, ``envelope``, ``owner``,
            or one of ``messages.check``: ``fields``, ``type``, ``shape``, ``non-finite``,
            ``range``. Nothing else is ever raised, whatever the bytes are.
    """
    if len(payload) > LARGEST:
        raise BadMessage("size", f"{len(payload)} bytes on {topic.name}")
    wire = _unpack(payload)
    if not isinstance(wire, dict) or wire.keys() != {"from", "seq", "body"}:
        raise BadMessage("envelope", "not a map of from, seq, body")
    seq, body = wire["seq"], wire["body"]
    if isinstance(seq, bool) or not isinstance(seq, int) or not 0 <= seq < _LAST_SEQ:
        raise BadMessage("envelope", "seq is not a count")
    if not isinstance(body, dict) or not all(isinstance(name, str) for name in body):
        raise BadMessage("envelope", "body is not a map of names")
    if wire["from"] != topic.owner:
        raise BadMessage("owner", f"{topic.name} is {topic.owner}'s, not {wire['from']!r}'s")
    try:
        return seq, check(topic.type, body)
    except BadMessage:
        raise
    except Exception as error:  # a field nobody thought of: still a refusal, never a crash
        raise BadMessage("type", f"{topic.name}: {error!r}") from error


def _unpack(payload: bytes) -> Any:
    try:
        return msgpack.unpackb(payload)
    except Exception as error:
        reason = "truncated" if "incomplete" in str(error) else "undecodable"
        raise BadMessage(reason, str(error)) from error


def pack_plain(value: Any) -> bytes:
    """Bytes of plain data: the arguments and the reply of a request."""
    return msgpack.packb(value, default=_plain)


def unpack_map(payload: bytes) -> dict[str, Any]:
    """Plain data from bytes.

    Raises:
        BadMessage: with reason ``size``, ``truncated``, ``undecodable`` or ``envelope``.
    """
    if len(payload) > LARGEST:
        raise BadMessage("size", f"{len(payload)} bytes")
    value = _unpack(payload)
    if not isinstance(value, dict) or not all(isinstance(name, str) for name in value):
        raise BadMessage("envelope", "not a map of names")
    return value
