"""Makes a whole log of one that was cut short."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from services.logs.file import BadLog, records, whole_records
from services.logs.writer import ABOUT, RECOVERED, LogWriter
from services.topics import TOPICS


@dataclass(frozen=True)
class Recovery:
    """What was got back.

    Attributes:
        file: the whole log.
        messages: in it.
        start: of the first message [s], and ``end`` of the last, robot time.
    """

    file: Path
    messages: int
    start: float
    end: float


def is_whole(path: Path) -> bool:
    """Whether a log was finished and can be read to its end.

    Raises:
        BadLog: it is no log of ours at all.
    """
    try:
        for _ in whole_records(path):
            pass
    except BadLog as error:
        if not error.cut:
            raise
        return False
    return True


def recover(path: Path, out: Path | None = None) -> Recovery:
    """Write all that is whole in a log that was cut short into a whole one.

    The cut log is read from its beginning, chunk by chunk, up to the first that is not whole.

    Args:
        path: of the cut log, which stays as it is.
        out: file to write; ``<name>-recovered.mcap`` beside it if not given.

    Raises:
        BadLog: it is no log of ours, is whole already, or nothing of it can be read.
        OSError: ``out`` cannot be written, or exists.
    """
    target = out or path.with_name(f"{path.stem}-recovered.mcap")
    if is_whole(path):
        raise BadLog(f"{path}: is a whole log; there is nothing to recover")
    about = next((r.metadata for r in records(path) if r.name == ABOUT and r.metadata), None)
    if about is None:
        raise BadLog(f"{path}: cut within its first bytes; there is nothing to recover")
    if target.exists():
        raise FileExistsError(17, "it exists; name another with -o", str(target))
    count, start, end, notes = 0, 0.0, 0.0, list[str]()
    with LogWriter(target, about) as writer:
        for record in records(path, notes=notes):
            if record.metadata is not None:
                if record.name != ABOUT:
                    writer.note(record.name, record.metadata)
                continue
            if record.name not in TOPICS:
                raise BadLog(f"{path}: topic {record.name!r} is not one of ours")
            writer.copy(record.name, record.data, record.stamp, record.time)
            start = record.time if not count else start
            count, end = count + 1, record.time
        writer.note(
            RECOVERED, {"from": path.name, "until": f"{end:.3f} s", "why": "; ".join(notes)}
        )
    return Recovery(target, count, start, end)
