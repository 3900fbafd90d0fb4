"""Lines of a summary: a figure with the interval it can be trusted to, and its goal."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import stats

LEVEL = 0.95
"""Confidence of every interval."""
RESAMPLES = 2000
"""Of a bootstrap; its generator has a fixed seed, so that the same rows give the same interval."""


@dataclass(frozen=True)
class Line:
    """One line of the table.

    Attributes:
        label: as people read it, with its unit.
        value: None if there is nothing to judge.
        low: of the 95 % interval; None if there is none.
        high: of it.
        n: trials it is made of.
        goal: what the value must reach; None if it need not.
        least: the goal is a lower bound.
        share: a share of one, shown in percent.
    """

    label: str
    value: float | None
    low: float | None
    high: float | None
    n: int
    goal: float | None = None
    least: bool = False
    share: bool = False

    @property
    def met(self) -> bool | None:
        """Whether the value reaches its goal; None if it need not, or there is no value."""
        if self.goal is None or self.value is None:
            return None
        return self.value >= self.goal if self.least else self.value <= self.goal


def share(
    label: str,
    outcomes: Iterable[bool],
    goal: float | None = None,
    least: bool = True,
    method: Literal["wilson", "exact"] = "wilson",
) -> Line:
    """How often something was so, with the interval of Wilson or (exact) Clopper and Pearson."""
    flags = [bool(x) for x in outcomes]
    if not flags:
        return Line(label, None, None, None, 0, goal, least, share=True)
    test = stats.binomtest(sum(flags), len(flags))
    interval = test.proportion_ci(LEVEL, method=method)
    return Line(
        label,
        sum(flags) / len(flags),
        float(interval.low),
        float(interval.high),
        len(flags),
        goal,
        least,
        share=True,
    )


def middle(
    label: str,
    values: Iterable[float | None],
    goal: float | None = None,
    least: bool = False,
    statistic: Callable[..., Any] = np.median,
) -> Line:
    """A statistic of the trials that have the value, the median by default, with its bootstrap.

    Args:
        label: of the line.
        values: of the trials; None where a trial has none.
        goal: for the statistic.
        least: the goal is a lower bound.
        statistic: takes an array and ``axis``.
    """
    kept = np.array([x for x in values if x is not None], dtype=float)
    if not len(kept):
        return Line(label, None, None, None, 0, goal, least)
    value = float(statistic(kept, axis=0))
    low: float | None
    high: float | None
    if len(kept) < 2:
        low = high = None
    elif np.ptp(kept) == 0.0:
        low = high = value  # all alike: nothing to draw from
    else:
        interval = stats.bootstrap(
            (kept,),
            statistic,
            n_resamples=RESAMPLES,
            confidence_level=LEVEL,
            method="percentile",
            rng=np.random.default_rng(0),
        ).confidence_interval
        low, high = float(interval.low), float(interval.high)
    return Line(label, value, low, high, len(kept), goal, least)


def worst(
    label: str, values: Iterable[float | None], goal: float | None = None, least: bool = False
) -> Line:
    """The largest (with ``least``: smallest) of all trials; an extreme has no interval."""
    kept = [float(x) for x in values if x is not None]
    value = (min(kept) if least else max(kept)) if kept else None
    return Line(label, value, None, None, len(kept), goal, least)
