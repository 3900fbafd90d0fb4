"""Judges a run of real processes from its log: its figures, and how late the loops were."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from services.live.plan import Plan
from services.logs.runlog import RunLog, read_run
from services.run import all_figures, outcome_of, write_report
from services.topics import HEALTH, TRUTH
from sim.scenario import load_scenario


def write_live_report(plan: Plan, folder: Path, ended: float) -> dict[str, Any]:
    """Read the log of a supervised run; write pictures and result beside it.

    Args:
        plan: what was run.
        folder: where its log is.
        ended: when, since the plan's epoch [s].

    Returns:
        The result, as of a lockstep run, with ``loops`` by service.

    Raises:
        BadLog: there is no log that can be read.
    """
    log, about, notes = read_run(folder)
    scenario = load_scenario(plan.scenario)
    truth = log.series(TRUTH)
    simulated = truth[-1].t if truth else 0.0
    result: dict[str, Any] = {
        "scenario": about.get("scenario", ""),
        "seed": plan.seed,
        "observer": plan.observer,
        "mode": plan.mode,
        "simulated_s": simulated,
        "realtime_factor": simulated / ended if ended > 0 else None,
        "outcome": outcome_of(log),
        **all_figures(log, scenario),
        "loops": loops_of(log),
        "log_notes": notes,
    }
    title = f"{result['scenario']}, observer {plan.observer}, {plan.mode}"
    write_report(log, result, folder, title, scenario=scenario)
    return result


def loops_of(log: RunLog) -> dict[str, dict[str, float]]:
    """Per service: period and lateness [ms] over its heartbeats, and ticks missed."""
    out = {}
    for name, topic in HEALTH.items():
        beats = [h for h in log.series(topic) if h.lateness and "mean" in h.period]
        if not beats:
            continue
        out[name] = {
            "period_mean_ms": 1e3 * float(np.mean([h.period["mean"] for h in beats])),
            "late_p50_ms": 1e3 * float(np.median([h.lateness["p50"] for h in beats])),
            "late_p99_ms": 1e3 * float(np.median([h.lateness["p99"] for h in beats])),
            "late_max_ms": 1e3 * max(h.lateness["max"] for h in beats),
            "missed": beats[-1].overruns,
            "ticks": beats[-1].progress,
        }
    return out
