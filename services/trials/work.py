"""What a worker does: one trial, and telling what it is."""

from __future__ import annotations

import json
import os
import time
import traceback
from pathlib import Path
from typing import Any, Literal, TypedDict

from services.trials.code import Code, code_of, differences
from services.trials.experiment import Row, load

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Environment of a worker: sums in parallel are added in another order, and cores are shared."""

Status = Literal["done", "failed", "lost"]


class WrongCode(RuntimeError):
    """A worker has other code than the campaign was started with."""


class Record(TypedDict):
    """A trial that ended.

    Attributes:
        seed: of the trial.
        status: done; failed: it raised; lost: the workers that ran it died.
        row: what it found; None unless done.
        error: what went wrong, in one line.
        traceback: the whole of it.
        seconds: that it took.
    """

    seed: int
    status: Status
    row: Row | None
    error: str
    traceback: str
    seconds: float


def run_trial(
    source: str,
    options: dict[str, Any],
    seed: int,
    code: Code | None,
    show_in: Path | None = None,
) -> Record:
    """Run one trial; what it raises is recorded.

    Args:
        source: of the experiment.
        options: as plain data, all of them.
        seed: of the trial.
        code: the campaign's; None to run with whatever is here.
        show_in: a folder for all there is to see, of an experiment that can show it.

    Raises:
        WrongCode: this worker is not the one to run it.
    """
    experiment = load(source)
    if code is not None and (found := differences(code, code_of(experiment))):
        raise WrongCode(f"a worker has other code: {', '.join(found)}")
    started = time.perf_counter()
    try:
        chosen = experiment.module.Options(**options)
        if show_in is None:
            row = plain(experiment.module.run(seed, chosen))
        else:
            row = plain(experiment.module.show(seed, chosen, show_in))
    except Exception as error:
        return Record(
            seed=seed,
            status="failed",
            row=None,
            error=f"{type(error).__name__}: {error}",
            traceback=traceback.format_exc(),
            seconds=time.perf_counter() - started,
        )
    seconds = time.perf_counter() - started
    return Record(seed=seed, status="done", row=row, error="", traceback="", seconds=seconds)


def plain(row: Any) -> Row:
    """A row as it comes back from a file.

    Raises:
        TypeError: it is no dict, or holds something JSON cannot.
    """
    if not isinstance(row, dict):
        raise TypeError(f"a trial gives a dict of plain data, not {type(row).__name__}")
    back: Row = json.loads(json.dumps(row))
    return back


class Probe(TypedDict):
    """What a worker is: its code, and by which environment its sums run in one thread."""

    code: Code
    threads: str


def probe(source: str) -> Probe:
    """Tell what this worker is, and import what its trials need."""
    return Probe(code=code_of(load(source)), threads=os.environ.get("OMP_NUM_THREADS", "unset"))
