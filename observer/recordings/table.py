"""A CSV file as columns of numbers; every cell that is no number keeps its row."""

from __future__ import annotations

import csv
import difflib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from observer.recordings.problems import Problems
from services.messages import Array

DELIMITERS = ",;\t"


class BadTable(ValueError):
    """A file that cannot be read as a table; the text says why."""


@dataclass(frozen=True)
class Table:
    """A CSV file.

    Attributes:
        name: of the file, for findings.
        cells: column by column, as text without blanks at the ends.
        rows: of each data row, the line in the file (the header is on line 1).
        twice: names that the header has more than once; ``cells`` holds the first.
        long: lines with more cells than the header has; they are not among ``rows``.
    """

    name: str
    cells: dict[str, list[str]]
    rows: NDArray[np.int64]
    twice: frozenset[str] = frozenset()
    long: tuple[int, ...] = ()

    @classmethod
    def read(cls, path: Path) -> Table:
        """Read a file: UTF-8, a header, and cells between commas, semicolons or tabs.

        Raises:
            BadTable: no such file, not text, no header, or a quote that is not closed.
        """
        try:
            text = path.read_text(encoding="utf-8-sig")
        except OSError:
            raise BadTable(f"{path.name}: no such file{_near_file(path)}") from None
        except UnicodeDecodeError:
            raise BadTable(f"{path.name}: not a text file in UTF-8") from None
        lines = text.splitlines()
        head = next((line for line in lines if line.strip()), "")
        delimiter = max(DELIMITERS, key=head.count)
        header: list[str] = []
        content, rows, long = [], [], []
        for line, cells in _records(path, lines, delimiter):
            if not any(cell.strip() for cell in cells):
                continue
            if not header:
                header = [cell.strip() for cell in cells]
                header[0] = header[0].lstrip("#").strip()
                continue
            if any(cell.strip() for cell in cells[len(header) :]):
                long.append(line)
                continue
            content.append(cells)
            rows.append(line)
        if not header or all(_is_number(name) for name in header):
            raise BadTable(f"{path.name}: no header: the first row must name the columns")
        n = len(header)
        content = [(row + [""] * n)[:n] if len(row) != n else row for row in content]
        columns = zip(*content, strict=True) if content else ([] for _ in header)
        named: dict[str, list[str]] = {}
        for name, column in zip(header, columns, strict=True):
            named.setdefault(name, [cell.strip() for cell in column])
        twice = frozenset(name for name in header if name and header.count(name) > 1)
        return cls(path.name, named, np.array(rows, dtype=np.int64), twice, tuple(long))

    def missing(self, columns: Sequence[str]) -> list[str]:
        """A sentence for each of the columns that is not there (with the nearest) or not unique."""
        out = []
        for wanted in columns:
            negated = wanted[0] == "-" and wanted not in self.cells
            if (wanted[1:] if negated else wanted) in self.twice:
                out.append(f"{self.name}: column {wanted!r} is there twice")
                continue
            if wanted in self.cells or (negated and wanted[1:] in self.cells):
                continue
            lower = {name.lower(): name for name in self.cells}
            near = difflib.get_close_matches(wanted.lstrip("-").lower(), lower, n=1, cutoff=0.5)
            hint = f"; did you mean {lower[near[0]]!r}?" if near else ""
            names = ", ".join(self.cells)
            out.append(f"{self.name}: no column {wanted!r}{hint} Columns: {names}")
        return out

    def texts(self, column: str) -> tuple[list[str], float]:
        """Cells of a column, and the sign that its name asks for."""
        if column in self.cells:
            return self.cells[column], 1.0
        return self.cells[column[1:]], -1.0


@dataclass(frozen=True)
class Rows:
    """The rows of a table in which a sensor has a sample.

    Attributes:
        values: shape (n, k), as written.
        rows: line of each in the file, shape (n,).
    """

    values: Array
    rows: NDArray[np.int64]

    def keep(self, mask: NDArray[np.bool_]) -> Rows:
        """Some of the rows."""
        return Rows(self.values[mask], self.rows[mask])


def numbers(
    table: Table, stamps: Sequence[str], columns: Sequence[str], where: str, problems: Problems
) -> Rows:
    """The rows in which all of ``stamps`` and ``columns`` are numbers; the others are reported.

    A row in which none of ``columns`` has anything belongs to another sensor: not reported.

    Args:
        table: where from; has all these columns.
        stamps: columns of time, first in the result.
        columns: columns of values.
        where: file and sensor, for findings.
        problems: takes the findings.
    """
    texts = [table.texts(name) for name in (*stamps, *columns)]
    n = len(table.rows)
    mine = np.zeros(n, dtype=bool)
    for cells, _ in texts[len(stamps) :]:
        mine |= np.array([cell != "" for cell in cells], dtype=bool)
    values = np.full((n, len(texts)), np.nan)
    good = mine.copy()
    for i, (cells, sign) in enumerate(texts):
        name = (*stamps, *columns)[i]
        values[:, i], bad = _floats(cells, mine)
        values[:, i] *= sign
        for why, rows in bad.items():
            text = f"column {name!r} {why}"
            problems.dropped(where, text, table.rows[rows].tolist(), int(mine.sum()))
            good[rows] = False
    return Rows(values[good], table.rows[good])


def _floats(cells: list[str], wanted: NDArray[np.bool_]) -> tuple[Array, dict[str, list[int]]]:
    """Numbers of a column (nan where there is none), and the bad ones by what is wrong."""
    try:
        out = np.array(cells, dtype=np.float64)
    except ValueError:
        out = np.array([float(c) if _is_number(c) else np.nan for c in cells])
    bad: dict[str, list[int]] = {}
    for k in np.flatnonzero(wanted & ~np.isfinite(out)).tolist():
        cell = cells[k]
        why = "is empty" if not cell else "is not finite" if _is_number(cell) else ""
        if not why:
            why = next((w for w in bad if w.startswith("is not a number")), "")
        bad.setdefault(why or f"is not a number, as {cell!r}", []).append(k)
    return out, bad


def _records(path: Path, lines: Sequence[str], delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Cells of each line, with its number; one record is one line.

    Raises:
        BadTable: a quote that is not closed on its line.
    """
    reader = csv.reader(lines, delimiter=delimiter, strict=True)
    before = 0
    while True:
        try:
            cells = next(reader, None)
        except csv.Error as error:
            raise BadTable(f"{path.name}: line {before + 1}: {error}: is a quote open?") from None
        if cells is None:
            return
        if reader.line_num > before + 1:
            raise BadTable(f"{path.name}: line {before + 1}: a quote is not closed on its line")
        before = reader.line_num
        yield before, cells


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _near_file(path: Path) -> str:
    if not path.parent.is_dir():
        return f"; nor is there a folder {path.parent.name!r}"
    names = sorted(p.name for p in path.parent.iterdir() if p.is_file())
    near = difflib.get_close_matches(path.name, names, n=1)
    return f"; did you mean {near[0]!r}?" if near else ""
