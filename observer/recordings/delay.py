"""By how much the stamps of wheels are late, told by the gyro."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from observer.recordings.figure import Figure, untold
from observer.recordings.increments import Noise, Turns, bottom, regress, usual
from observer.recordings.series import Curve, touches
from services.messages import Array

LATEST, EARLIEST = 0.8, -0.5
"""Delays that are looked for [s]."""
COARSE, FINE = 0.01, 0.002
"""Steps of the search [s]."""
BLOCKS = 10
"""Parts of which each is left out once, to see how far the delay depends on it."""
SURE = 10.0
"""Scale over its standard deviation, from which the gyro explains the wheels' turns."""
SHARP = 0.015
"""Largest standard deviation with which a delay counts as told [s]."""
RIVAL = 25.0
"""Another lag must cost this much more (in units of the noise) for the best to be the only one."""
CREEPS = 5.0
"""Standard deviations from which a growing delay is corrected for and the fit done again."""
MOST = 5.0
"""Largest factor by which scatter over the log widens the deviation of the drift."""
UNSEEN = untold("not looked for")
NONE = Noise(0.0, 0.0)


@dataclass(frozen=True)
class TurnFit:
    """Wheels against gyro.

    Attributes:
        delay: stamps of the wheels minus stamps of the gyro, of the same turn [s].
        scale: turn by wheels over turn by gyro.
        rate: turning by wheels that the gyro does not see, minus its bias [rad/s].
        drift: growth of the delay [s/s] ...
        middle: ... and the stamp at which it is ``delay`` [s].
        noise: of the wheels' turns.
        turned: by wheels, root mean square of the turning rate [rad/s].
        residual: what is left of that rate, root mean square [rad/s].
    """

    delay: Figure
    scale: Figure
    rate: float = math.nan
    drift: Figure = UNSEEN
    middle: float = 0.0
    noise: Noise = NONE
    turned: float = math.nan
    residual: float = math.nan


def fit_turns(
    turns: Turns,
    gyro: Curve,
    holes: list[tuple[float, float]],
    least: Noise,
) -> TurnFit:
    """Find delay, scale and noise of wheels against a gyro.

    Args:
        turns: by wheels.
        gyro: integrated yaw rate [rad].
        holes: gaps of the gyro (start, end) [s].
        least: noise that there must be: rounding, noise of the gyro.
    """
    middle = 0.5 * float(turns.start[0] + turns.end[-1]) if len(turns) else 0.0
    fit = _fit(turns, gyro, holes, least, middle)
    growth = fit.drift.value
    if growth is None or not fit.drift.beyond(0.0, 0.0, CREEPS):
        return fit
    straight = Turns(
        without_drift(turns.start, growth, middle),
        without_drift(turns.end, growth, middle),
        turns.turned,
        turns.chained,
    )
    again = _fit(straight, gyro, holes, least, middle)
    drift = Figure(growth + again.drift.otherwise(0.0), again.drift.sigma)
    return replace(again, drift=drift)


def without_drift(t: Array, growth: float, middle: float) -> Array:
    """Stamps (n,) [s] whose delay does not grow, by ``growth`` [s/s] from ``middle`` [s]."""
    return t - growth * (t - middle)


def _fit(
    turns: Turns, gyro: Curve, holes: list[tuple[float, float]], least: Noise, middle: float
) -> TurnFit:
    """The fit for a delay that stays the same."""
    there = _seen(turns, gyro, holes, EARLIEST, LATEST)
    if len(there) < 30:
        return _nothing(f"only {len(there)} samples of wheels with gyro beside them")
    turned = float(np.std(there.turned / (there.end - there.start)))
    still = f"too little motion: the wheels turn at {math.degrees(turned):.2g} deg/s rms"
    if turned < 1e-6:
        return _nothing("too little motion: the wheels do not turn at all", turned)
    near, alone, noise = _search(there, gyro, least)
    there = _seen(turns, gyro, holes, near - 0.05, near + 0.05)
    there = there.keep(usual(regress(there, gyro, near, noise).residual))
    if len(there) < 30:
        return _nothing(still, turned)
    fine = np.asarray(near + np.arange(-8, 9) * FINE, dtype=np.float64)
    delay, sigma = _refine(there, gyro, fine, noise)
    at = regress(there, gyro, delay, noise)
    if not at.scale > SURE * at.scale_sigma:
        return _nothing(still, turned)
    told = alone and sigma < SHARP
    vague = "too little change of turning to tell one delay from another"
    inflation = max(sigma / _curvature_sigma(there, gyro, fine, noise), 1.0)
    drift = _drift(there, gyro, delay, at.scale, noise, middle)
    return TurnFit(
        delay=Figure(delay, sigma) if told else untold(vague),
        scale=Figure(at.scale, at.scale_sigma * inflation),
        rate=at.rate,
        drift=Figure(drift.value, drift.sigma * min(inflation, MOST)) if told else untold(vague),
        middle=middle,
        noise=noise,
        turned=turned,
        residual=float(np.sqrt(np.mean((at.residual / (there.end - there.start)) ** 2))),
    )


def _search(there: Turns, gyro: Curve, least: Noise) -> tuple[float, bool, Noise]:
    """The best lag on the coarse grid [s], whether it is the only one, and the noise."""
    lags = np.arange(EARLIEST, LATEST + COARSE, COARSE)
    noise = Noise(max(least.white, 1e-14), max(least.walk, 1e-12))
    for _ in range(3):
        costs = np.array([regress(there, gyro, lag, noise).cost for lag in lags])
        best = regress(there, gyro, float(lags[np.argmin(costs)]), noise)
        good = usual(best.residual)
        new = Noise.of(there, np.where(good, best.residual, 0.0), least)
        new = Noise(max(new.white, 1e-14), max(new.walk, 1e-12))
        there, noise, before = there.keep(good), new, noise
        if good.all() and abs(math.log(_power(new, there) / _power(before, there))) < 0.1:
            break
    costs = np.array([regress(there, gyro, lag, noise).cost for lag in lags])
    k = int(np.argmin(costs))
    unit = max(float(costs[k]) / max(len(there) - 3, 1), 1e-12)
    away = np.abs(lags - lags[k]) > 0.08
    alone = float(np.min(costs[away]) - costs[k]) / unit > RIVAL
    return float(lags[k]), alone and 0 < k < len(lags) - 1, noise


def _nothing(reason: str, turned: float = math.nan) -> TurnFit:
    return TurnFit(delay=untold(reason), scale=untold(reason), turned=turned)


def _power(noise: Noise, turns: Turns) -> float:
    return 2.0 * noise.white + noise.walk * float(np.mean(turns.end - turns.start))


def _seen(
    turns: Turns, gyro: Curve, holes: list[tuple[float, float]], first: float, last: float
) -> Turns:
    """The turns of which the gyro tells something at every lag from ``first`` to ``last`` [s]."""
    start, end = turns.start - last, turns.end - first
    good = (start >= gyro.start) & (end <= gyro.end) & ~touches(start, end, holes)
    return turns.keep(np.asarray(good))


def _refine(turns: Turns, gyro: Curve, lags: Array, noise: Noise) -> tuple[float, float]:
    """The best lag [s] and its standard deviation, with every block of the log left out once."""
    squares = np.stack([regress(turns, gyro, lag, noise).white ** 2 for lag in lags])
    costs = squares.sum(axis=1)
    best, curvature = bottom(lags, costs)
    if curvature <= 0.0:
        return float(lags[np.argmin(costs)]), math.inf
    sigma = math.sqrt(2.0 * float(costs.min()) / max(len(turns) - 3, 1) / curvature)
    blocks = np.array_split(np.arange(len(turns)), BLOCKS)
    if len(turns) >= 10 * BLOCKS:
        without = [bottom(lags, costs - squares[:, block].sum(axis=1))[0] for block in blocks]
        jackknife = math.sqrt((BLOCKS - 1) * float(np.var(without)))
        sigma = max(sigma, jackknife)
    return min(max(best, float(lags[0])), float(lags[-1])), sigma


def _curvature_sigma(turns: Turns, gyro: Curve, lags: Array, noise: Noise) -> float:
    costs = np.array([regress(turns, gyro, lag, noise).cost for lag in lags[::4]])
    _, curvature = bottom(lags[::4], costs)
    if curvature <= 0.0:
        return math.inf
    return math.sqrt(2.0 * float(costs.min()) / max(len(turns) - 3, 1) / curvature)


def _drift(
    turns: Turns, gyro: Curve, delay: float, scale: float, noise: Noise, middle: float
) -> Figure:
    """Growth of the delay: what a lag that grows from the middle of the log would explain."""
    a, b = turns.start - delay, turns.end - delay
    h = 1e-3

    def swept(t: Array) -> Array:
        return (gyro(t + h) - gyro(t - h)) / (2.0 * h) * (t + delay - middle)

    columns = np.stack([gyro(b) - gyro(a), b - a, swept(b) - swept(a), turns.turned], axis=1)
    w = noise.whiten(turns, columns)
    inverse = np.linalg.pinv(w[:, :3].T @ w[:, :3], hermitian=True)
    solved = inverse @ (w[:, :3].T @ w[:, 3])
    left = w[:, 3] - w[:, :3] @ solved
    unit = float(left @ left) / max(len(left) - 4, 1)
    sigma = math.sqrt(unit * float(inverse[2, 2])) / abs(scale)
    return Figure(-float(solved[2]) / scale, sigma)
