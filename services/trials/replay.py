"""One trial again, in this process, beside what the campaign wrote down of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from services.trials.code import code_of, differences
from services.trials.experiment import Experiment
from services.trials.journal import BadFolder, read_about, read_records
from services.trials.options import checked
from services.trials.work import Record, run_trial


@dataclass(frozen=True)
class Replayed:
    """A trial that was run again.

    Attributes:
        record: what came of it.
        options: it was run with.
        same: whether row or error are those of the campaign; None if there is none to compare.
        changed: what of the code is not as it was in the campaign.
        files: folder of what the experiment showed of it; None if it showed nothing.
    """

    record: Record
    options: dict[str, Any]
    same: bool | None
    changed: list[str]
    files: Path | None


def replay(experiment: Experiment, given: dict[str, Any], seed: int, folder: Path) -> Replayed:
    """Run a trial again.

    Args:
        experiment: what is tried.
        given: options; those of the campaign in the folder hold for the others.
        seed: of the trial.
        folder: of a campaign, if there is one, to compare with; what is shown goes in it, too.

    Raises:
        BadExperiment: an option is wrong.
        BadFolder: the folder holds a campaign of another experiment.
        OSError: it cannot be written.
    """
    about = read_about(folder)
    if about is not None and about.experiment != experiment.source:
        raise BadFolder(f"{folder} holds trials of {about.experiment}, not {experiment.source}")
    options = (about.options if about is not None else {}) | given
    complete = checked(experiment, options).model_dump(mode="json")
    files = None
    if hasattr(experiment.module, "show"):
        files = folder / f"replay-{seed}"
        files.mkdir(parents=True, exist_ok=True)
    record = run_trial(experiment.source, complete, seed, code=None, show_in=files)
    same, changed = None, []
    if about is not None and about.options == complete:
        old = read_records(folder).get(seed)
        if old is not None and old["status"] != "lost":
            same = (old["row"], old["error"]) == (record["row"], record["error"])
            changed = differences(about.code, code_of(experiment))
    return Replayed(record, complete, same, changed, files)
