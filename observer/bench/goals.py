"""What the observer is meant to reach, as a table, and whether it does."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from observer.bench.rows import Key, Row

Rows = Mapping[Key, Row]
Value = Callable[[Row, Rows], float | None]
SMOOTH = ("sway", "drive", "docking", "standing", "tilt", "scale")


@dataclass(frozen=True)
class Goal:
    """A bound on a figure of the product.

    Attributes:
        text: what is bounded, with its unit.
        motions: classes of motion in which it holds; none named: in all.
        value: of a row of the product, given all rows by `Key`; None: not measured.
        high: largest good value.
        low: smallest good value.
        rates: of odometry at which it holds [Hz]; none named: at all.
        band: the bounds are the row's band of the NEES instead.
    """

    text: str
    motions: tuple[str, ...]
    value: Value
    high: float = math.inf
    low: float = -math.inf
    rates: tuple[float, ...] = ()
    band: bool = False

    def bounds(self, row: Row) -> tuple[float, float]:
        """Smallest and largest good value in a row."""
        if not self.band:
            return self.low, self.high
        low, high = row["nees_band"]
        return low, high


@dataclass(frozen=True)
class Verdict:
    """Whether a goal is met.

    Attributes:
        goal: which one.
        met: None: not measured.
        value: the worst of all rows the goal holds in.
        bounds: smallest and largest good value there.
        where: motion and rate of that row.
        missed: every motion and rate where it is missed.
        rows: how many were looked at.
    """

    goal: Goal
    met: bool | None
    value: float = math.nan
    bounds: tuple[float, float] = (-math.inf, math.inf)
    where: str = ""
    missed: tuple[str, ...] = ()
    rows: int = 0


def field(name: str) -> Value:
    """A figure of the row."""
    return lambda row, rows: row[name]


def _against_single(row: Row, rows: Rows) -> float | None:
    key = Key(row["motion"], row["odometry_hz"], "single")
    mine, other = row["in_push_rms_mm"], rows[key]["in_push_rms_mm"] if key in rows else None
    return None if mine is None or not other else mine / other


GOALS: tuple[Goal, ...] = (
    Goal("position error over exact", ("sway", "drive"), field("ratio_to_exact"), 1.08),
    Goal("heading error over exact", ("sway", "drive"), field("yaw_ratio_to_exact"), 0.9),
    Goal("largest step [mm/ms]", SMOOTH, field("max_step_mm_per_ms"), 0.02),
    Goal("largest step in a push [mm/ms]", ("push",), field("max_step_mm_per_ms"), 0.035),
    Goal(
        "largest step of heading [deg/ms]",
        (*SMOOTH, "push"),
        field("max_step_deg_per_ms"),
        0.002,
    ),
    Goal("NEES in motion", ("sway", "drive"), field("nees"), band=True),
    Goal("NEES at standstill", ("standing",), field("nees"), band=True),
    Goal("error in a push over that of one model", ("push",), _against_single, 0.5),
    Goal("slip alarms in pushes, per 10 min", ("push",), field("false_alarms_per_10min"), 0.0),
    Goal("within 3 sigma after 1 s blind", ("dropout",), field("gap_inside_3_sigma"), low=0.99),
    Goal("error 0.5 s after it over before", ("dropout",), field("gap_after_over_before"), 1.2),
    Goal("step on its return [mm/ms]", ("dropout",), field("gap_step_mm_per_ms"), 0.05),
    Goal(
        "slip flagged within 0.2 s",
        ("slip",),
        field("flagged_within_200ms"),
        low=1.0,
        rates=(10.0, 20.0),
    ),
    Goal("false slip alarms per 10 min", (), field("false_alarms_per_10min"), 1.0),
    Goal("cost of a step, median [us]", (), field("step_us_median"), 10.0),
    Goal("cost with odometry, 99 % [us]", (), field("replay_us_p99"), 200.0),
)


def check(
    rows: Sequence[Row], goals: Sequence[Goal] = GOALS, product: str = "ekf"
) -> list[Verdict]:
    """Hold rows against the goals.

    Args:
        rows: as of `observer.bench.rows.rows`.
        goals: to be checked.
        product: the estimator they are about.
    """
    known = {Key(r["motion"], r["odometry_hz"], r["estimator"]): r for r in rows}
    return [_verdict(goal, known, product) for goal in goals]


def _verdict(goal: Goal, rows: Rows, product: str) -> Verdict:
    worst, missed, seen = None, [], 0
    for key, row in rows.items():
        if key.estimator != product or (goal.motions and key.motion not in goal.motions):
            continue
        if goal.rates and key.odometry_hz not in goal.rates:
            continue
        value = goal.value(row, rows)
        if value is None:
            continue
        seen += 1
        low, high = goal.bounds(row)
        where = f"{key.motion} {key.odometry_hz:g} Hz"
        excess = max(value - high, low - value)
        if excess > 0:
            missed.append(where)
        if worst is None or excess > worst[0]:
            worst = (excess, Verdict(goal, excess <= 0, value, (low, high), where))
    if worst is None:
        return Verdict(goal, None)
    return replace(worst[1], missed=tuple(missed), rows=seen)
