"""A log as files for other tools: CSV, or Parquet, one file a topic."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from services.logs.file import BadLog
from services.logs.table import STAMP, not_there, tables_of

Columns = Mapping[str, Any]


def export(
    path: Path, folder: Path, kind: str = "csv", topics: Sequence[str] = ()
) -> dict[Path, int]:
    """Write topics of a log as tables.

    Args:
        path: of a whole log.
        folder: where to; ``robot/imu`` becomes ``robot-imu.csv``.
        kind: one of ``KINDS``.
        topics: names of those to write; all if not given.

    Returns:
        The files, and how many rows each has.

    Raises:
        BadLog: no whole log, or a topic that is not in it.
        ValueError: unknown kind.
        OSError: the folder cannot be written.
    """
    if kind not in KINDS:
        raise ValueError(f"no format {kind!r}. Known: {', '.join(KINDS)}")
    tables = tables_of(path, topics or None)
    for name in topics:
        if name not in tables:
            raise not_there(path, name)
    folder.mkdir(parents=True, exist_ok=True)
    out = {}
    for name, columns in tables.items():
        file = folder / f"{name.replace('/', '-')}.{kind}"
        KINDS[kind](file, columns)
        out[file] = len(columns[STAMP])
    return out


def _csv(file: Path, columns: Columns) -> None:
    """Numbers to the last bit; what is missing is an empty cell."""
    lists = [_cells(c) if isinstance(c, np.ndarray) else c for c in columns.values()]
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*lists, strict=True))


def _cells(column: Any) -> list[Any]:
    cells = column.tolist()
    return [None if c != c else c for c in cells] if np.isnan(column).any() else cells


def _parquet(file: Path, columns: Columns) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise BadLog(
            "Parquet needs the package pyarrow, which is not installed here: make setup,"
            " or pip install pyarrow; or export as csv"
        ) from None
    parquet.write_table(pyarrow.table(dict(columns)), file, compression="zstd")


KINDS: dict[str, Callable[[Path, Columns], None]] = {"csv": _csv, "parquet": _parquet}
"""Formats."""
