"""Runs a scenario in lockstep and judges it."""

from __future__ import annotations

import gc
import json
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from services.components import build_service
from services.lockstep import TICK, Lockstep
from services.logs.provenance import provenance
from services.logs.runlog import RunLog
from services.messages import BASE_ENDED, PROGRAM_ENDED
from services.reports.bottle import bottle_figures
from services.reports.evaluation import arm_worked, figures_of, pen_figures
from services.reports.grasp import grasp_figures
from services.reports.platform_figures import platform_figures
from services.service import Service
from services.topics import ARM_STATUS, BASE_STATUS
from sim.scenario import Scenario

AFTER = 0.5
"""How long a run goes on after the program has ended [s]."""
TOLD_TICKS = 200
"""Ticks between two words on how far a run is."""


@dataclass
class Run:
    """A finished run: its messages and its figures."""

    scenario: Scenario
    log: RunLog
    result: dict[str, Any]


def run_lockstep(
    scenario: Scenario,
    seed: int,
    observer: str = "ekf",
    duration: float | None = None,
    after: float = AFTER,
    late: Mapping[str, int] | None = None,
    services: Sequence[Service] | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> Run:
    """Run a scenario until its program has ended or its time is over.

    Where no arm runs, or it has nothing to run, the program is that of the platform, or what else
    the platform is to do.

    Args:
        scenario: what happens.
        seed: of everything random.
        observer: kind of observer.
        duration: instead of the scenario's [s].
        after: how long to go on after the program has ended [s].
        late: ticks of delay on top of the usual one, by the name of the topic.
        services: instead of those of the scenario; in the order of ``topics.SERVICES``.
        progress: told now and then of the robot time [s] and what is going on.

    Raises:
        BadFile, ProgramError, ValueError: the scenario, its program or the observer is wrong.
    """
    log = RunLog()
    if services is None:
        services = [build_service(name, scenario, seed, observer) for name in scenario.services]
    lockstep = Lockstep(services, listener=log, late=late)
    limit = round((scenario.duration if duration is None else duration) / TICK)
    armed = any(service.name == "arm" for service in services)
    works = armed and (scenario.task.program or not scenario.task.autostart)
    spoken, endings = (ARM_STATUS, PROGRAM_ENDED) if works else (BASE_STATUS, BASE_ENDED)
    statuses = log.messages.setdefault(spoken.name, [])
    ended: int | None = None
    seen = 0
    started, processor = time.perf_counter(), time.process_time()
    with without_collector():
        while lockstep.tick < limit and (ended is None or lockstep.tick < ended + after / TICK):
            lockstep.step()
            if progress is not None and lockstep.tick % TOLD_TICKS == 0:
                last = statuses[-1] if statuses else None
                progress(lockstep.now, getattr(last, "node", "") or getattr(last, "state", ""))
            if ended is None and len(statuses) > seen:
                seen = len(statuses)
                if statuses[-1].state in endings:  # type: ignore[attr-defined]
                    ended = lockstep.tick
    wall, processor = time.perf_counter() - started, time.process_time() - processor
    simulated = lockstep.now
    result: dict[str, Any] = {
        "scenario": scenario.name,
        "seed": seed,
        "observer": observer,
        "simulated_s": simulated,
        "realtime_factor": simulated / wall,
        "processor_s": processor,
        "outcome": outcome_of(log),
    }
    return Run(scenario, log, result | all_figures(log, scenario))


@contextmanager
def without_collector() -> Iterator[None]:
    """Keep the garbage collector from searching the growing log over and over.

    The tick leaves no cycles behind (live services run without collector as well).
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def all_figures(log: RunLog, scenario: Scenario) -> dict[str, float | bool | None]:
    """Of estimate, pen and platform, None where meaningless, and whether the arm worked."""
    return {
        "arm_worked": arm_worked(log),
        **figures_of(log),
        **pen_figures(log, scenario.task.board),
        **platform_figures(log, scenario.task.base),
        **grasp_figures(log),
        **bottle_figures(log, scenario.task.bottle),
    }


def outcome_of(log: RunLog) -> str:
    """How the arm's program ended, in words; without an arm, what the platform was to do."""
    statuses = log.series(ARM_STATUS)
    if not statuses or (not statuses[-1].reason and all(s.state == "idle" for s in statuses)):
        return _outcome_of_platform(log)
    last = statuses[-1]
    end = last.state if not last.reason else f"{last.state}: {last.reason}"
    # of the newest program: what came after it does not undo it
    drawn = next((s.state for s in reversed(statuses) if s.state in ("running", "finished")), "")
    return f"finished; afterwards {end}" if drawn == "finished" != last.state else end


def _outcome_of_platform(log: RunLog) -> str:
    statuses = log.series(BASE_STATUS)
    if not statuses:
        return "neither arm nor platform spoke"
    last = statuses[-1]
    what = last.state if not last.reason else f"{last.state}: {last.reason}"
    well = last.state in BASE_ENDED and last.state != "aborted"
    return f"finished; the platform {what}" if well else what


def write(run: Run, folder: Path) -> None:
    """Write the log of a run to ``folder`` and put its digest into the result."""
    folder.mkdir(parents=True, exist_ok=True)
    about = provenance(run.scenario, run.result["seed"], run.result["observer"])
    run.result["log_sha256"] = run.log.write(folder / "run.mcap", about)


def write_report(
    log: RunLog,
    result: dict[str, Any],
    folder: Path,
    title: str,
    pictures: bool = True,
    scenario: Scenario | None = None,
) -> None:
    """Write the result as ``result.json``, and the pictures beside it.

    Args:
        log: of a run.
        result: of it.
        folder: where to.
        title: of each picture.
        pictures: whether to draw any.
        scenario: that was run, for the picture of the floor.
    """
    plain = json.dumps(_known(result), indent=2, allow_nan=False)
    (folder / "result.json").write_text(plain + "\n")
    if pictures:
        # slow to import, and not always wanted
        from services.reports.pictures import write_pictures

        write_pictures(log, folder, title, scenario)


def _known(value: Any) -> Any:
    """The same with None for what is not a number, which JSON has no word for."""
    if isinstance(value, dict):
        return {name: _known(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_known(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
