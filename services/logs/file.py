"""What is in a log file, record by record, whether it is whole, cut short, or no log at all."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message, Metadata
from mcap.records import Header as McapHeader
from mcap.stream_reader import CRCValidationError, StreamReader

from services.logs.writer import LIBRARY

MAGIC = b"\x89MCAP0\r\n"
_BROKEN = (
    McapError,
    CRCValidationError,
    zstandard.ZstdError,
    struct.error,
    zlib.error,
    ValueError,  # text that is none, a size that is none
    KeyError,
    AssertionError,
    MemoryError,
    OverflowError,
)
"""What reading bytes that are no MCAP may raise."""


class BadLog(ValueError):
    """A file that is no log of ours; the text names it and says how to go on.

    Attributes:
        cut: it begins as a log, and some of it can be read.
    """

    def __init__(self, text: str, cut: bool = False) -> None:
        super().__init__(text)
        self.cut = cut


@dataclass(frozen=True, slots=True)
class Record:
    """A message or metadata.

    Attributes:
        name: of the topic, or of the metadata.
        time: at which a message was sent or heard, robot time [s].
        stamp: instant at which a message's content was true [s].
        data: of a message, JSON.
        metadata: words, if it is metadata.
    """

    name: str
    time: float = 0.0
    stamp: float = 0.0
    data: bytes = b""
    metadata: dict[str, str] | None = None


def whole_records(path: Path, topics: Collection[str] | None = None) -> Iterator[Record]:
    """Metadata and messages of a whole log, in the order of the file.

    Args:
        path: of the file.
        topics: names of those to read; all if not given.

    Raises:
        BadLog: it cannot be opened, is no log of ours, or is cut short.
    """
    begins_as_log(path)
    try:
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            try:
                header = reader.get_header()
                if reader.get_summary() is None:
                    raise cut_short(path)
            except _BROKEN as error:
                raise cut_short(path) from error
            if header.library != LIBRARY:
                raise BadLog(
                    f"{path}: an MCAP file, but written by {header.library!r}, not by steadyhand;"
                    " logs of other robots: docs/logs.md"
                )
            for data in reader.iter_metadata():
                yield Record(data.name, metadata=dict(data.metadata))
            for _, channel, message in reader.iter_messages(
                None if topics is None else list(topics), log_time_order=False
            ):
                yield _of(channel, message)
    except _BROKEN as error:
        if isinstance(error, BadLog):
            raise
        raise BadLog(
            f"{path}: damaged inside ({error}). What comes before that is whole:"
            f" steadyhand log recover {path}",
            cut=True,
        ) from error


def records(
    path: Path, topics: Collection[str] | None = None, notes: list[str] | None = None
) -> Iterator[Record]:
    """Metadata and messages of a log as far as it is whole.

    Args:
        path: of the file.
        topics: names of those to read; all if not given.
        notes: is told where it ends if it is cut short.

    Raises:
        BadLog: it cannot be opened, or does not begin as a log of ours.
    """
    begins_as_log(path)
    channels: dict[int, Channel] = {}
    time = 0.0
    with path.open("rb") as stream:
        found = StreamReader(stream, validate_crcs=True).records
        try:
            for record in found:
                if isinstance(record, McapHeader) and record.library != LIBRARY:
                    raise BadLog(f"{path}: written by {record.library!r}, not by steadyhand")
                if isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Metadata):
                    yield Record(record.name, metadata=dict(record.metadata))
                elif isinstance(record, Message):
                    time = record.log_time / 1e9
                    channel = channels[record.channel_id]
                    if topics is None or channel.topic in topics:
                        yield _of(channel, record)
        except _BROKEN as error:
            if isinstance(error, BadLog):
                raise
            if notes is not None:
                notes.append(f"{path.name} is cut short: it is whole until {time:.3f} s")


def _of(channel: Channel, message: Message) -> Record:
    return Record(channel.topic, message.log_time / 1e9, message.publish_time / 1e9, message.data)


def _runs_here() -> str:
    """The newest runs in the folder where commands put them, for somebody who mistyped one."""
    found = {log.parent for log in Path("runs").glob("*/*.mcap")}
    newest = sorted(found, key=lambda run: run.stat().st_mtime, reverse=True)[:3]
    return f". The newest runs here: {', '.join(map(str, newest))}" if newest else ""


def begins_as_log(path: Path) -> None:
    """Raise BadLog for what cannot be opened or does not begin as an MCAP file."""
    try:
        with path.open("rb") as stream:
            start = stream.read(len(MAGIC))
    except FileNotFoundError:
        raise BadLog(f"{path}: no such file{_runs_here()}") from None
    except OSError as error:
        raise BadLog(f"{path}: cannot be read: {error.strerror}") from None
    if not start:
        raise BadLog(f"{path}: is empty: its recorder was killed before it wrote anything")
    if start != MAGIC:
        raise BadLog(
            f"{path}: no log of steadyhand: it does not begin as an MCAP file."
            " Logs are runs/*/run.mcap; logs of other robots: docs/logs.md"
        )


def cut_short(path: Path) -> BadLog:
    """The error of a log without an end."""
    return BadLog(
        f"{path}: not a whole log: its recorder was killed before it finished the file, or the"
        f" file was cut. What is whole in it: steadyhand log recover {path}",
        cut=True,
    )


__all__ = ["BadLog", "Record", "begins_as_log", "cut_short", "records", "whole_records"]
