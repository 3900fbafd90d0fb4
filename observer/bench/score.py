"""One run judged: sums, peaks and single values that can be put together over runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from observer.bench.figures import (
    Mask,
    detections,
    pieces,
    power_above,
    relative_error,
    shift_costs,
)
from observer.bench.motions import START
from observer.bench.play import Track
from observer.bench.world import DT, PUSH_TIME, SLIP, World
from observer.metrics import nees
from services.messages import Array, Odometry

LAGS = {"100ms": 0.1, "500ms": 0.5, "1s": 1.0}
"""Durations over which motion is compared [s]."""
AFTERMATH = 0.3
"""A push counts until so long after its end [s]."""
BINS = np.linspace(0.0, 0.1, 201)
"""Of the histogram of steps [mm/ms]; larger steps are counted in the last one."""
MOVING = 0.005
"""Latency is defined where the truth is faster than this, rms [m/s]."""
SERIES = 0.05
"""NEES over time is kept in means over so long [s]."""
RETURN = 0.5
"""From the return of odometry until all is to be as before [s]."""


@dataclass
class Score:
    """What a run adds to the figures.

    Attributes:
        sums: added up over runs; arrays element by element.
        peaks: the largest over runs counts.
        values: listed over runs.
    """

    sums: dict[str, Array] = field(default_factory=dict)
    peaks: dict[str, float] = field(default_factory=dict)
    values: dict[str, list[float]] = field(default_factory=dict)

    def add(self, name: str, *amounts: ArrayLike) -> None:
        """Put numbers or arrays (flattened) to the sums, one after the other."""
        self.sums[name] = np.concatenate(
            [np.ravel(np.asarray(a, dtype=np.float64)) for a in amounts]
        )

    def merge(self, other: Score) -> None:
        """Take in the score of another run."""
        for name, amount in other.sums.items():
            self.sums[name] = self.sums[name] + amount if name in self.sums else amount
        for name, peak in other.peaks.items():
            self.peaks[name] = max(self.peaks.get(name, -math.inf), peak)
        for name, some in other.values.items():
            self.values.setdefault(name, []).extend(some)


def judge(track: Track, world: World, detects: bool) -> Score:
    """Judge a run.

    Args:
        track: what an estimator said.
        world: the truth.
        detects: whether the estimator can report slip.
    """
    s = Score()
    t = world.t[track.index]
    error = track.pose - world.reference[track.index]
    error[:, 2] = (error[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
    mask = world.judged(START)[track.index]
    _accuracy(s, track, world, error, mask)
    if track.step == 1:
        _smoothness(s, track, world, error, mask)
    _consistency(s, track, error, mask, t)
    _events(s, track, world, error, t)
    if detects:
        delays, alone = detections(
            track.slip, t, tuple(slip[0] for slip in world.conditions.slips), SLIP[1]
        )
        s.values["detection"] = delays
        s.add("alarms", float(np.sum(alone & mask)), float(np.sum(mask)) * track.step * DT)
    cost = track.cost[t >= START]
    if np.isfinite(cost).all():
        s.values["step_us_median"] = [1e6 * float(np.median(cost))]
        s.values["step_us_p99"] = [1e6 * float(np.quantile(cost, 0.99))]
        replay = cost[~np.isnan(track.odometry_nis[t >= START])]
        s.values["replay_us_p99"] = [1e6 * float(np.quantile(replay, 0.99))]
    return s


def _accuracy(s: Score, track: Track, world: World, error: Array, mask: Mask) -> None:
    e = error[mask]
    squares = e * e
    s.add("squares", np.sum(squares[:, :2]), np.sum(squares[:, 2]), len(e))
    s.peaks["mm"] = 1e3 * math.sqrt(float(np.max(squares[:, 0] + squares[:, 1])))
    s.peaks["deg"] = math.degrees(float(np.max(np.abs(e[:, 2]))))
    for name, lag in LAGS.items() if track.step else ():
        n = round(lag / DT / track.step)
        total = np.zeros(2)
        for p in pieces(mask):
            if p.stop - p.start > n:
                truth = world.reference[track.index[p]]
                r = relative_error(track.pose[p], truth, n)
                total += np.sum(r * r), len(r)
        s.add(f"relative {name}", total)
    speed = world.velocity[track.index][mask, :2]
    if float(np.mean(np.sum(speed * speed, axis=1))) > MOVING**2:
        s.add("shifts", shift_costs(track.pose[:, :2], world.reference[:, :2], track.index, mask))


def _smoothness(s: Score, track: Track, world: World, error: Array, mask: Mask) -> None:
    fast = np.zeros(3)
    counts = np.zeros(len(BINS) - 1)
    s.peaks["step mm"] = s.peaks["step deg"] = 0.0
    for p in pieces(mask):
        d = np.diff(error[p], axis=0)
        steps = 1e3 * np.hypot(d[:, 0], d[:, 1])
        counts += np.histogram(np.minimum(steps, BINS[-1]), BINS)[0]
        s.peaks["step mm"] = max(s.peaks["step mm"], float(np.max(steps, initial=0.0)))
        turn = math.degrees(float(np.max(np.abs(d[:, 2]), initial=0.0)))
        s.peaks["step deg"] = max(s.peaks["step deg"], turn)
        length = p.stop - p.start
        power = power_above(track.velocity[p] - world.velocity[p], 1.0 / DT)
        if power is not None:
            fast += length * (power[0] + power[1]), length * power[2], length
    s.add("step counts", counts)
    s.add("fast", fast)


def _consistency(s: Score, track: Track, error: Array, mask: Mask, t: Array) -> None:
    values = np.full(len(t), math.nan)
    values[mask] = nees(error[mask], track.covariance[mask])
    s.add("nees", np.sum(values[mask]), np.sum(mask))
    slot = np.rint((t - START) / DT).astype(np.int64) // round(SERIES / DT)
    size = int(slot[-1])  # the last one may be short
    keep = mask & (slot < size)
    total = np.bincount(slot[keep], values[keep], minlength=size)
    s.add("nees over time", total, np.bincount(slot[keep], minlength=size))
    for name, series in (("odometry", track.odometry_nis), ("imu", track.imu_nis)):
        seen = series[mask & ~np.isnan(series)]
        if np.any(seen > 0.0):  # who does not filter reports zero
            s.add(f"{name} nis", np.sum(seen), len(seen))


def _events(s: Score, track: Track, world: World, error: Array, t: Array) -> None:
    """Pushes, and the time without odometry."""
    way = 1e3 * np.hypot(error[:, 0], error[:, 1])
    for start in world.conditions.pushes:
        during = way[(t >= start) & (t < start + PUSH_TIME + AFTERMATH)]
        s.merge(Score({"push": np.array([np.sum(during**2), len(during)])}))
        s.merge(Score(peaks={"push": float(np.max(during))}))
    start, end = world.conditions.odometry_gap
    if not START < start < end < t[-1] - 2.0 * RETURN:
        return
    back = next(at for at, m in world.arrivals if isinstance(m, Odometry) and m.t >= end)
    last = int(np.searchsorted(t, back - 1e-9)) - 1
    sigma = np.sqrt(np.diag(track.covariance[last]))
    s.values["gap inside"] = [float((np.abs(error[last]) <= 3.0 * sigma).all())]
    s.values["gap end"] = [float(way[last])]
    before = way[(t >= start - RETURN) & (t < start)]
    after = way[(t >= back + RETURN) & (t < back + 2.0 * RETURN)]
    s.add("gap", np.sum(before**2), len(before), np.sum(after**2), len(after))
    if track.step == 1:
        d = np.diff(error[last : last + round(RETURN / DT) + 1, :2], axis=0)
        s.peaks["gap step"] = 1e3 * float(np.max(np.hypot(d[:, 0], d[:, 1])))
