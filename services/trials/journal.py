"""A campaign's folder: what it is, and a line for each trial as soon as it has ended."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

from services.trials.code import Code, differences
from services.trials.work import Record

ABOUT, TRIALS = "campaign.json", "trials.jsonl"


class BadFolder(ValueError):
    """A folder cannot be used for a campaign; the text says how to go on."""


@dataclass(frozen=True)
class About:
    """What a campaign's results depend on.

    Attributes:
        experiment: its source (``Experiment.source``).
        seed: of the first trial; the others follow by one.
        options: all of them, as plain data.
        code: what it is run with.
    """

    experiment: str
    seed: int
    options: dict[str, Any]
    code: Code


class Journal:
    """The open journal of a campaign."""

    def __init__(self, file: IO[bytes], records: dict[int, Record]) -> None:
        self._file = file
        self.records = records
        """Newest record of each seed."""

    def add(self, record: Record) -> None:
        """Write a trial down; it is on the disk when this returns."""
        self.records[record["seed"]] = record
        self._file.write(json.dumps(record).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())


@contextmanager
def opened(folder: Path, about: About, resume: bool) -> Iterator[Journal]:
    """Begin a campaign in a folder, or go on with the one that is there.

    Raises:
        BadFolder: it holds another campaign, or one that is not to be resumed or is running.
        OSError: it cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / TRIALS).open("a+b") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BadFolder(f"a campaign is running in {folder}; give another --out") from None
        records = _records(folder, file)
        old = read_about(folder)
        if old is not None and records:
            if not resume:
                raise BadFolder(
                    f"{folder} holds a campaign: --resume goes on with it, another --out keeps it"
                )
            _same(folder, old, about)
        elif resume and old is None:
            raise BadFolder(f"{folder} holds no campaign to go on with; leave out --resume")
        else:
            _replace(folder / ABOUT, json.dumps(asdict(about), indent=2) + "\n")
        yield Journal(file, records)


def read_about(folder: Path) -> About | None:
    """What campaign a folder holds, None if it holds none.

    Raises:
        BadFolder: it cannot be read.
    """
    path = folder / ABOUT
    if not path.is_file():
        return None
    try:
        return About(**json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, TypeError) as error:
        raise BadFolder(f"{path} is not a campaign's: {error}. Give another --out") from None


def read_records(folder: Path) -> dict[int, Record]:
    """Newest record of each seed in a folder; none if there is no journal.

    Raises:
        BadFolder: it cannot be read.
    """
    path = folder / TRIALS
    if not path.is_file():
        return {}
    with path.open("rb") as file:
        return _parsed(path, _whole(file.read()))


def _records(folder: Path, file: IO[bytes]) -> dict[int, Record]:
    file.seek(0)
    content = file.read()
    whole = _whole(content)
    if len(whole) < len(content):
        file.truncate(len(whole))  # the line that was being written when it was interrupted
    return _parsed(folder / TRIALS, whole)


def _whole(content: bytes) -> bytes:
    return content[: content.rfind(b"\n") + 1]


def _parsed(path: Path, content: bytes) -> dict[int, Record]:
    records: dict[int, Record] = {}
    for number, line in enumerate(content.splitlines(), 1):
        try:
            record: Record = json.loads(line)
            records[record["seed"]] = record
        except (ValueError, KeyError, TypeError):
            raise BadFolder(
                f"{path}:{number}: not a trial. Delete that line to run the trial again"
            ) from None
    return records


def _same(folder: Path, old: About, new: About) -> None:
    found = []
    if old.experiment != new.experiment:
        found.append(f"its experiment is {old.experiment}, not {new.experiment}")
    if old.seed != new.seed:
        found.append(f"its first seed is {old.seed}, not {new.seed}")
    for key in sorted({*old.options, *new.options}):
        before, after = old.options.get(key), new.options.get(key)
        if before != after:
            found.append(f"its {key} is {before!r}, not {after!r}")
    if found:
        raise BadFolder(
            f"{folder} holds another campaign: {'; '.join(found)}. "
            "Ask for the same again, or give another --out"
        )
    if changed := differences(old.code, new.code):
        raise BadFolder(
            f"the code changed since {folder} was begun: {', '.join(changed)}. "
            "Go back to that code to go on, or begin anew with another --out"
        )


def _replace(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    fresh = path.with_suffix(".new")
    fresh.write_text(text, encoding="utf-8")
    fresh.replace(path)
