"""Collects what is wrong with a log, so that everything is said at once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from deploy.tomlfile import BadFile
from observer.recordings.log import Verdict

MOST = 20
"""Findings that are listed; of more, only the number."""
TOLERATED = 0.05
"""Share of a sensor's rows that may be dropped; beyond it the log is refused."""


class Problems:
    """Errors (the log is refused) and notes (it is read all the same), in order."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.errors: list[str] = []
        self.notes: list[Verdict] = []

    def error(self, text: str) -> None:
        """Something that makes the log unusable."""
        if text not in self.errors:
            self.errors.append(text)

    def note(self, code: str, text: str, advice: str = "") -> None:
        """Something inferred, said so that nobody is surprised."""
        self.notes.append(Verdict("note", code, text, advice))

    def warning(self, code: str, text: str, advice: str = "") -> None:
        """Something that costs accuracy."""
        self.notes.append(Verdict("warning", code, text, advice))

    def dropped(self, where: str, why: str, rows: Sequence[int], of: int) -> None:
        """Rows that were left out; an error if they are more than ``TOLERATED``.

        Args:
            where: file and sensor.
            why: what is wrong with them, as the end of "3 rows dropped: ...".
            rows: their numbers in the file.
            of: rows that the sensor has.
        """
        if not len(rows):
            return
        first = f"first in row {rows[0]}" if len(rows) > 1 else f"row {rows[0]}"
        if len(rows) > max(TOLERATED * of, 3):
            self.error(f"{where}: {len(rows)} of {of} rows cannot be used: {why} ({first})")
        else:
            noun = "row" if len(rows) == 1 else "rows"
            self.warning("rows-dropped", f"{where}: {len(rows)} {noun} dropped: {why} ({first})")

    def raise_if_any(self) -> None:
        """Refuse the log if there was an error.

        Raises:
            BadFile: with every error, up to `MOST`.
        """
        if self.errors:
            more = len(self.errors) - MOST
            raise BadFile(self.path, self.errors[:MOST] + [f"and {more} more"] * (more > 0))
