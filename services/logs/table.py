"""A log's topics as tables: one row a message, one column a number or word."""

from __future__ import annotations

import re
from array import array
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from services.logs.file import BadLog, whole_records
from services.messages import Array

STAMP, ARRIVAL = "t", "arrival"
"""Columns of every table: instant the content was true, instant it was sent or heard [s]."""


def flat(content: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers and words of a message with their paths: ``pose.0``, ``votes.drive.2``."""
    if isinstance(content, dict):
        for key, value in content.items():
            yield from flat(value, f"{name}.{key}" if name else key)
    elif isinstance(content, list):
        if content and all(isinstance(item, str) for item in content):
            yield name, "; ".join(content)
            return
        for k, value in enumerate(content):
            yield from flat(value, f"{name}.{k}")
    else:
        yield name, content


class Table:
    """Columns that grow message by message; what a message does not have is missing.

    Attributes:
        columns: by path; numbers as ``array``, words and truth values as list.
    """

    def __init__(self) -> None:
        self.columns: dict[str, array[float] | list[Any]] = {}
        self.rows = 0

    def add(self, cells: Iterable[tuple[str, Any]]) -> None:
        """Add a row."""
        for name, value in cells:
            column = self.columns.get(name)
            if column is None:
                number = isinstance(value, (int, float)) and not isinstance(value, bool)
                column = array("d") if number else []
                self.columns[name] = column
            if isinstance(column, list):
                column += [None] * (self.rows - len(column))
                column.append(value)
                continue
            column.extend([np.nan] * (self.rows - len(column)))
            column.append(np.nan if value is None else value)
        self.rows += 1

    def finish(self) -> dict[str, Array | list[Any]]:
        """The columns, all of one length."""
        out: dict[str, Array | list[Any]] = {}
        for name, column in self.columns.items():
            if isinstance(column, list):
                out[name] = column + [None] * (self.rows - len(column))
            else:
                column.extend([np.nan] * (self.rows - len(column)))
                out[name] = np.frombuffer(column, dtype=np.float64)
        return out


def tables_of(
    path: Path, topics: Collection[str] | None = None
) -> dict[str, dict[str, Array | list[Any]]]:
    """Messages of a whole log by topic and column; ``t`` and ``arrival`` come first.

    Args:
        path: of the log.
        topics: names of those to read; all if not given.

    Raises:
        BadLog: it is no whole log of ours.
    """
    tables: dict[str, Table] = defaultdict(Table)
    for record in whole_records(path, topics):
        if record.metadata is None:
            content = orjson.loads(record.data)
            content.pop(STAMP, None)
            row = [(STAMP, record.stamp), (ARRIVAL, record.time), *flat(content)]
            tables[record.name].add(row)
    return {name: tables[name].finish() for name in sorted(tables)}


def not_there(path: Path, topic: str) -> BadLog:
    """The error of a topic that a log has nothing on."""
    from services.logs.info import info_of

    known = ", ".join(t.name for t in info_of(path).topics)
    return BadLog(f"{path}: nothing on {topic!r}. Topics: {known}")


def series_of(path: Path, field: str) -> dict[str, tuple[Array, Array]]:
    """Numbers over time: stamps and values of every column that a field path means.

    Args:
        path: of a whole log.
        field: ``topic:path``, for example ``robot/imu:gyro.2``, or ``robot/imu:gyro`` for all
            its components; a topic alone means everything in it.

    Raises:
        BadLog: no whole log, no such topic, or no numbers there; the text lists what there is.
    """
    topic, _, wanted = field.partition(":")
    table = tables_of(path, (topic,)).get(topic)
    if table is None:
        missing = not_there(path, topic)
        raise BadLog(f"{missing}. A field is TOPIC:FIELD, as in robot/imu:gyro")
    times = np.asarray(table[STAMP])
    numbers = {
        name: np.asarray(column, dtype=np.float64)
        for name, column in table.items()
        if name not in (STAMP, ARRIVAL)
        and (not isinstance(column, list) or all(isinstance(v, bool) for v in column))
    }
    chosen = {
        f"{topic}:{name}": (times, column)
        for name, column in numbers.items()
        if not wanted or name == wanted or name.startswith(f"{wanted}.")
    }
    if not chosen:
        fields = sorted({re.sub(r"(\.\d+)+$", "", name) for name in numbers})
        raise BadLog(f"{topic}: no numbers in {wanted!r}. Fields: {', '.join(fields)}")
    return chosen
