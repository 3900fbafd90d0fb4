"""A campaign from its beginning to its table and pictures."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from services.trials.experiment import Experiment, Row
from services.trials.journal import About, Journal, opened
from services.trials.lines import Line
from services.trials.work import Record

ROWS, SUMMARY = "rows.json", "summary.json"


@dataclass(frozen=True)
class Effort:
    """What the trials of this call cost; those of an earlier one are not counted.

    Attributes:
        trials: that ended.
        workers: that ran them.
        busy: time spent in trials, over all workers [s].
        wall: from handing out the first to the end of the last [s].
    """

    trials: int
    workers: int
    busy: float
    wall: float

    @property
    def efficiency(self) -> float | None:
        """Share of the workers' time spent in trials; None if there was none."""
        return self.busy / (self.wall * self.workers) if self.wall > 0 and self.trials else None


@dataclass(frozen=True)
class Outcome:
    """A campaign that ended.

    Attributes:
        about: what it is.
        folder: where it is.
        records: in the order of their seeds.
        lines: the table.
        pictures: the files.
        effort: what it cost.
    """

    about: About
    folder: Path
    records: list[Record]
    lines: list[Line]
    pictures: list[Path]
    effort: Effort

    @property
    def unfinished(self) -> list[Record]:
        """The trials that failed or were lost."""
        return [record for record in self.records if record["status"] != "done"]

    def data(self) -> dict[str, Any]:
        """All of it as plain data; tracebacks are left to the journal."""
        told = ("seed", "status", "error")
        return {
            "experiment": self.about.experiment,
            "seed": self.about.seed,
            "trials": len(self.records),
            "options": self.about.options,
            "code": self.about.code,
            "summary": [asdict(line) | {"met": line.met} for line in self.lines],
            "unfinished": [{key: dict(r)[key] for key in told} for r in self.unfinished],
            "effort": asdict(self.effort) | {"efficiency": self.effort.efficiency},
            "folder": str(self.folder),
            "pictures": [str(path) for path in self.pictures],
        }


def conduct(
    experiment: Experiment,
    about: About,
    trials: int,
    folder: Path,
    workers: int | None,
    address: str | None,
    resume: bool,
    watch: Callable[[Record | None, int, int], None],
) -> Outcome:
    """Run what is missing of a campaign, then judge all of it.

    Args:
        experiment: what is tried.
        about: the campaign; its options are complete and checked.
        trials: how many there are to be in the end.
        folder: of the campaign.
        workers: processes on this machine (None: 1), or the most to use of a cluster (None: all).
        address: of a cluster; None for this machine.
        resume: go on with what the folder holds.
        watch: told of every trial as it ends (None at the start), how many have, and of how many.

    Raises:
        BadFolder, BadCluster: it could not be begun, or not go on.
        OSError: the folder cannot be written.
    """
    seeds = range(about.seed, about.seed + trials)
    with opened(folder, about, resume) as journal:
        missing = [seed for seed in seeds if not _ended(journal.records.get(seed))]
        watch(None, trials - len(missing), trials)
        effort = Effort(0, 0, 0.0, 0.0)
        if missing:
            left = len(missing)

            def told(record: Record) -> None:
                nonlocal left
                left -= 1
                watch(record, trials - left, trials)

            effort = _work(about, missing, journal, workers, address, told)
        records = [journal.records[seed] for seed in seeds]
        return _judge(experiment, about, records, folder, effort)


def _ended(record: Record | None) -> bool:
    """Whether a trial need not be run again: one that raised would raise again, a lost one not."""
    return record is not None and record["status"] != "lost"


def _work(
    about: About,
    seeds: list[int],
    journal: Journal,
    workers: int | None,
    address: str | None,
    told: Callable[[Record], None],
) -> Effort:
    from services.trials import cluster  # Dask is slow to import, and not needed without work

    wanted = workers if workers is not None or address is not None else 1
    local = min(wanted or 1, len(seeds))
    with cluster.connected(local, address) as client:
        there = cluster.examine(client, about.experiment, about.code)
        width = there if wanted is None else min(wanted, there)
        started, busy, ended = time.perf_counter(), 0.0, 0
        source, options = about.experiment, about.options
        for record in cluster.run(client, source, options, seeds, about.code, width):
            journal.add(record)
            busy += record["seconds"]
            ended += 1
            told(record)
        return Effort(ended, width, busy, time.perf_counter() - started)


def _judge(
    experiment: Experiment, about: About, records: list[Record], folder: Path, effort: Effort
) -> Outcome:
    rows = rows_of(records)
    # a file that is the same bits however the trials were run
    _write(folder / ROWS, [{"seed": r["seed"], "row": r["row"]} for r in records])
    lines = experiment.module.summary(rows)
    pictures = experiment.module.pictures(rows, folder) if rows else []
    outcome = Outcome(about, folder, records, lines, pictures, effort)
    _write(folder / SUMMARY, outcome.data())
    return outcome


def rows_of(records: Iterable[Record]) -> list[Row]:
    """What the trials that were done found."""
    return [record["row"] for record in records if record["row"] is not None]


def _write(path: Path, value: Any) -> None:
    path.write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8")
