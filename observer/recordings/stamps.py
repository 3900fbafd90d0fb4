"""Stamps of a log: in which unit, in which order, and when a sample could be used."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from observer.recordings.description import TimeUnit
from observer.recordings.problems import Problems
from observer.recordings.series import runs
from observer.recordings.table import Rows
from services.messages import Array

UNITS: dict[TimeUnit, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
SLOWEST = {"reference": 1.5}
"""Longest period believed of a sensor [s] ..."""
SLOW = 0.8
"""... and of the others, where the unit of time is not given."""
FAR = 3600.0
"""A step this long [s] is no gap but another time."""
RESTART = 10
"""So many stamps in a row that fit nowhere are a clock that was set, not bad rows."""
AHEAD = 1e-3
"""Arrival this much before sampling [s] is said."""
OTHER_CLOCK = (-0.05, 5.0)
"""Arrival minus stamp [s] beyond this: the two were told by different clocks."""


@dataclass(frozen=True)
class Timed:
    """Rows with their times; see `Rows`."""

    t: Array
    """Stamps [s], strictly increasing, not yet relative to the log's origin."""
    arrival: Array
    values: Array


def infer_unit(stamps: Array, sensor: str) -> TimeUnit:
    """The largest unit in which the period is one that such a sensor can have.

    Args:
        stamps: shape (n,), finite.
        sensor: name of its table.
    """
    steps = np.abs(np.diff(stamps))
    steps = steps[steps > 0]
    period = float(np.median(steps)) if len(steps) else 0.0
    slowest = SLOWEST.get(sensor, SLOW)
    for unit, second in UNITS.items():
        if period * second <= slowest:
            return unit
    return "s"


def longest_increase(stamps: Array) -> NDArray[np.bool_]:
    """Mask (n,) of the largest set of stamps that strictly increase in their given order."""
    tails: list[float] = []
    last: list[int] = []
    before = np.full(len(stamps), -1)
    for k, value in enumerate(stamps.tolist()):
        i = bisect_left(tails, value)
        before[k] = last[i - 1] if i else -1
        if i == len(tails):
            tails.append(value)
            last.append(k)
        else:
            tails[i], last[i] = value, k
    keep = np.zeros(len(stamps), dtype=bool)
    k = last[-1] if last else -1
    while k >= 0:
        keep[k] = True
        k = int(before[k])
    return keep


def in_order(rows: Rows, second: float, where: str, problems: Problems) -> Rows:
    """The rows whose stamps (first column) increase; repeated and misplaced ones are reported.

    Args:
        rows: as read.
        second: one unit of the stamps [s].
        where: file and sensor, for findings.
        problems: takes the findings.
    """
    n = len(rows.rows)
    same = np.zeros(n, dtype=bool)
    if n > 1:
        same[1:] = (np.diff(rows.values, axis=0) == 0.0).all(axis=1)
    if same.any():
        problems.note(
            "repeated-rows",
            f"{where}: {int(same.sum())} rows repeat the one before them, stamp and all;"
            f" dropped (first in row {rows.rows[same][0]})",
        )
        rows = rows.keep(~same)
    of = len(rows.rows)
    equal = np.diff(rows.values[:, 0], prepend=np.nan) == 0.0
    problems.dropped(where, "stamp equal to the one before", rows.rows[equal].tolist(), of)
    rows = rows.keep(~equal)
    keep = longest_increase(rows.values[:, 0])
    _restarts(keep, rows, second, where, problems)
    wrong = rows.rows[~keep].tolist()
    problems.dropped(where, "stamps go backwards or leap", wrong, of)
    rows = rows.keep(keep)
    return _one_time(rows, second, where, problems)


def _restarts(
    keep: NDArray[np.bool_], rows: Rows, second: float, where: str, problems: Problems
) -> None:
    """An error where a whole stretch of stamps fits nowhere."""
    stamps = rows.values[:, 0]
    for start, end in runs(~keep):
        if end - start >= RESTART and len(np.unique(stamps[start:end])) >= RESTART:
            back = np.flatnonzero(np.diff(stamps) < 0) + 1
            near = int(back[np.argmin(np.abs(back - start))])
            leap = (stamps[near - 1] - stamps[near]) * second
            problems.error(
                f"{where}: stamps go back by {leap:.3g} s at row {rows.rows[near]} and go on from"
                " there: a clock that was set or two logs in one; split the file there"
            )
            return


def _one_time(rows: Rows, second: float, where: str, problems: Problems) -> Rows:
    """Without a few rows of quite another time at either end; an error if they are many."""
    stamps = rows.values[:, 0] * second
    leaps = np.flatnonzero(np.diff(stamps) > FAR) + 1
    if not len(leaps):
        return rows
    pieces = np.split(np.arange(len(stamps)), leaps)
    longest = max(pieces, key=len)
    keep = np.zeros(len(stamps), dtype=bool)
    keep[longest] = True
    hours = float(np.max(np.diff(stamps))) / 3600.0
    why = f"stamps of another time, {hours:.3g} h away"
    problems.dropped(where, why, rows.rows[~keep].tolist(), len(stamps))
    return rows.keep(keep)


def timed(
    rows: Rows,
    *,
    received: bool,
    latency: float,
    second: float,
    delay: float,
    where: str,
    problems: Problems,
) -> Timed:
    """Turn ordered rows into times and values.

    Args:
        rows: first column the stamps; second the arrival if ``received``; then the values.
        received: whether there is a column of arrival.
        latency: from sampling to arrival, otherwise [s].
        second: one unit of time [s].
        delay: the stamps are this much too late [s].
        where: file and sensor, for findings.
        problems: takes the findings.
    """
    t = rows.values[:, 0] * second - delay
    if not received:
        return Timed(t, t + latency, rows.values[:, 1:])
    arrival = rows.values[:, 1] * second
    lag = arrival - t
    if len(t) and not OTHER_CLOCK[0] <= float(np.median(lag)) <= OTHER_CLOCK[1]:
        near = np.abs(lag - np.median(lag)) <= OTHER_CLOCK[1]
        arrival = arrival - float(np.min(lag[near]))
        problems.warning(
            "two-clocks",
            f"{where}: arrival is {np.median(lag):.6g} s from the stamp: two clocks",
            "the quickest sample was taken to arrive at once",
        )
    wild = (arrival - t < OTHER_CLOCK[0]) | (arrival - t > OTHER_CLOCK[1])
    why = f"arrival not within {OTHER_CLOCK[0]:g} to {OTHER_CLOCK[1]:g} s of the stamp"
    problems.dropped(where, why, rows.rows[wild].tolist(), len(t))
    rows, t, arrival = rows.keep(~wild), t[~wild], arrival[~wild]
    early = arrival < t - AHEAD
    if early.any():
        problems.note(
            "arrived-early",
            f"{where}: {int(early.sum())} samples arrive before they were sampled, by up to"
            f" {1e3 * float(np.max(t - arrival)):.1f} ms (first in row {rows.rows[early][0]});"
            " taken to arrive at once",
        )
    return Timed(t, np.maximum(arrival, t), rows.values[:, 2:])
