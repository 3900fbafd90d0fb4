"""Scores of many runs put together: the rows of the table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from observer.bench.estimators import REFERENCE
from observer.bench.figures import best_shift
from observer.bench.score import LAGS, SERIES, Score
from observer.metrics import chi2_band

Row = dict[str, Any]


class Key(NamedTuple):
    """Which runs belong together."""

    motion: str
    odometry_hz: float
    estimator: str


UNITS: dict[str, str] = {
    "rms_mm": "position error, rms of the norm over x and y",
    "rms_deg": "heading error, rms",
    "max_mm": "largest position error",
    "max_deg": "largest heading error",
    **{f"relative_{name}_mm": f"error of the motion over {name}, rms" for name in LAGS},
    "ratio_to_exact": "rms_mm over that of exact in the same worlds",
    "yaw_ratio_to_exact": "rms_deg over that of exact in the same worlds",
    "max_step_mm_per_ms": "largest change beyond the true motion in 1 ms",
    "max_step_deg_per_ms": "the same of heading",
    "fast_mm2_s2": "power of the velocity error above 20 Hz, x plus y [(mm/s)^2]",
    "fast_deg2_s2": "the same of the yaw rate [(deg/s)^2]",
    "latency_ms": "by how much the path is late: the shift with the least error",
    "nees": "mean of e' P^-1 e of the pose, P as reported; 3 if P is true",
    "nees_band": "in which that mean lies with 95 % if P is true, for this number of runs",
    "nees_in_band": "share of time in which the mean over the runs is in the band",
    "odometry_nis": "mean NIS of odometry; 3 if the filter is true",
    "odometry_nis_band": "95 % band of it for this number of readings",
    "imu_nis": "mean NIS of the IMU; 3 if the filter is true",
    "imu_nis_band": "95 % band of it for this number of readings",
    "in_push_rms_mm": "position error from the start of a push to 0.3 s after its end, rms",
    "in_push_max_mm": "the largest there",
    "flagged_within_200ms": "share of slips reported within 0.2 s from their start",
    "detection_ms_median": "from the start of a slip to its report, of those reported",
    "detection_ms_max": "the longest",
    "false_alarms_per_10min": "slip reported where none was",
    "gap_inside_3_sigma": "share of runs with all three errors within 3 sigma at the gap's end",
    "gap_end_mm": "position error at the end of the gap, rms",
    "gap_after_over_before": "rms error 0.5 to 1 s after the return over 0.5 s before the gap",
    "gap_step_mm_per_ms": "largest step within 0.5 s from the return",
    "step_us_median": "cost of a step, all ticks (1 kHz); median over runs",
    "step_us_p99": "its 99th percentile; median over runs",
    "replay_us_p99": "the same of ticks in which odometry arrived",
    "garbage_per_tick": "objects per tick that only the garbage collector could free",
}
"""Figures of a row: what each means. None stands for: not defined here."""


def rows(scores: Mapping[Key, Score], runs: int) -> list[Row]:
    """The rows, in the order of ``scores``."""
    out = []
    for key, score in scores.items():
        row: Row = {**key._asdict(), "runs": runs, **_figures(score, runs)}
        reference = scores.get(key._replace(estimator=REFERENCE))
        if reference is not None:
            base = _figures(reference, runs)
            row["ratio_to_exact"] = _ratio(row["rms_mm"], base["rms_mm"])
            row["yaw_ratio_to_exact"] = _ratio(row["rms_deg"], base["rms_deg"])
        head = ("motion", "odometry_hz", "estimator", "runs")
        out.append({name: row.get(name) for name in (*head, *UNITS)})
    return out


def nees_over_time(score: Score) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Instants after the start of judging [s] and the mean NEES over the runs there, (n,) each."""
    total, count = score.sums["nees over time"].reshape(2, -1)
    full = count == np.max(count)  # where slip hides some runs, the mean is of too few
    return (np.flatnonzero(full) + 0.5) * SERIES, total[full] / count[full]


def _ratio(a: float, b: float) -> float | None:
    return a / b if b > 0 else None


def _root(total: float, count: float) -> float | None:
    return math.sqrt(total / count) if count else None


def _figures(score: Score, runs: int) -> Row:
    s = score.sums
    xy, yaw, n = s["squares"]
    row: Row = {
        "rms_mm": 1e3 * math.sqrt(xy / n),
        "rms_deg": math.degrees(math.sqrt(yaw / n)),
        "max_mm": score.peaks["mm"],
        "max_deg": score.peaks["deg"],
        "max_step_mm_per_ms": score.peaks.get("step mm"),
        "max_step_deg_per_ms": score.peaks.get("step deg"),
        "in_push_max_mm": score.peaks.get("push"),
        "gap_step_mm_per_ms": score.peaks.get("gap step"),
    }
    for name in LAGS:
        if f"relative {name}" in s:
            total, count = s[f"relative {name}"]
            root = _root(total, count)
            row[f"relative_{name}_mm"] = None if root is None else 1e3 * root
    if "fast" in s and s["fast"][2]:
        row["fast_mm2_s2"] = 1e6 * s["fast"][0] / s["fast"][2]
        row["fast_deg2_s2"] = math.degrees(1.0) ** 2 * s["fast"][1] / s["fast"][2]
    if "shifts" in s:
        row["latency_ms"] = best_shift(s["shifts"])
    row |= _consistency(score, runs)
    if "push" in s:
        row["in_push_rms_mm"] = _root(*s["push"])
    if "gap" in s:
        before, after = _root(*s["gap"][:2]), _root(*s["gap"][2:])
        row["gap_after_over_before"] = (after or 0.0) / before if before else None
        row["gap_inside_3_sigma"] = float(np.mean(score.values["gap inside"]))
        row["gap_end_mm"] = math.sqrt(np.mean(np.square(score.values["gap end"])))
    if "alarms" in s:
        row["false_alarms_per_10min"] = 600.0 * s["alarms"][0] / s["alarms"][1]
    if delays := score.values.get("detection"):
        seen = [1e3 * d for d in delays if math.isfinite(d)]
        row["flagged_within_200ms"] = sum(d <= 200.0 for d in seen) / len(delays)
        row["detection_ms_median"] = float(np.median(seen)) if seen else None
        row["detection_ms_max"] = max(seen, default=None)
    for name in ("step_us_median", "step_us_p99", "replay_us_p99", "garbage_per_tick"):
        if name in score.values:
            row[name] = float(np.median(score.values[name]))
    return {k: float(v) if isinstance(v, np.floating) else v for k, v in row.items()}


def _consistency(score: Score, runs: int) -> Row:
    s = score.sums
    low, high = chi2_band(3, runs)
    _, series = nees_over_time(score)
    row: Row = {
        "nees": s["nees"][0] / s["nees"][1],
        "nees_band": [low, high],
        "nees_in_band": float(np.mean((series >= low) & (series <= high))),
    }
    for name in ("odometry", "imu"):
        if f"{name} nis" in s:
            total, count = s[f"{name} nis"]
            row[f"{name}_nis"] = total / count
            row[f"{name}_nis_band"] = list(chi2_band(3, int(count)))
    return row
