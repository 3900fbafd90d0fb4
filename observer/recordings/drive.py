"""How the drive answers commands: lag, dead time, and what it does unasked."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.signal import lfilter

from observer.commands import CommandHistory
from observer.recordings.figure import Figure, untold
from observer.recordings.recording import Samples
from services.messages import Array

PERIOD = 0.005
"""Of the simulated drive [s]."""
LAGS = np.geomspace(0.03, 1.5, 12)
DEAD = np.arange(0.0, 0.31, 0.05)
SILENCE = CommandHistory().silence
"""After the last command for so long [s] the drive is taken to stop, as in the observer."""
EXPLAINED = 0.7
"""Share of the squares of speed that commands must explain."""
SMOOTH = 0.25
"""Speeds are means over this long when accelerations are asked for [s]."""
EARNED = 0.9
"""A dead time must leave less than this share of the squares that a lag alone leaves."""
MOVING = 0.01
"""Commanded speed that is motion, root mean square [m/s or rad/s]."""


@dataclass(frozen=True)
class Drive:
    """A drive of first order.

    Attributes:
        lag: time constant [s].
        dead: before it begins to answer [s].
        disturbance: acceleration that commands do not explain, standard deviation (3)
            [m/s^2, m/s^2, rad/s^2]; nan where not told.
        explained: share of the squares of speed that commands explain.
    """

    lag: Figure
    dead: Figure
    disturbance: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    explained: float = math.nan


def steps_in_B(odometry: Samples) -> tuple[Array, Array, Array]:
    """Start and end (n,) [s] of odometry's steps, and those steps along B (n, 3) [m, m, rad]."""
    d = np.diff(odometry.values, axis=0)
    middle = 0.5 * (odometry.values[1:, 2] + odometry.values[:-1, 2])
    c, s = np.cos(middle), np.sin(middle)
    body = np.stack([c * d[:, 0] + s * d[:, 1], -s * d[:, 0] + c * d[:, 1], d[:, 2]], axis=1)
    return odometry.t[:-1], odometry.t[1:], body


def fit_drive(
    commands: Samples,
    odometry: Samples,
    delay: float,
    resolution: tuple[float, float, float],
    correlation: float,
) -> Drive:
    """Find lag and dead time.

    Args:
        commands: V_OB_B.
        odometry: poses.
        delay: of odometry's stamps [s].
        resolution: of odometry [m, m, rad].
        correlation: time over which the disturbance is alike [s].
    """
    start, end, body = steps_in_B(odometry)
    grid = np.arange(commands.t[0], min(commands.t[-1], end[-1]), PERIOD)
    last = np.maximum(np.searchsorted(commands.t, grid, side="right") - 1, 0)
    u = commands.values[last] * (grid - commands.t[last] < SILENCE)[:, None]
    a, b = start - delay, end - delay
    keep = (a > grid[0] + 1.0 if len(grid) else a > a) & (b < grid[-1] if len(grid) else b > b)
    keep &= end - start < 5.0 * odometry.period
    a, b, speed = a[keep], b[keep], body[keep] / (end - start)[keep, None]
    told = np.sqrt(np.mean(u**2, axis=0)) > MOVING if len(u) else np.zeros(3, dtype=bool)
    if len(a) < 50 or not told.any():
        none = untold("too few commands that move the platform")
        return Drive(none, none)
    power = np.maximum(np.mean(speed**2, axis=0), 1e-12)

    def left(lag: float, dead: float) -> Array:
        """What a drive does not explain of the speeds, (n, 3)."""
        keeps = math.exp(-PERIOD / lag)
        v = lfilter([1.0 - keeps], [1.0, -keeps], u, axis=0)
        way = np.vstack([np.zeros(3), np.cumsum(v, axis=0)[:-1]]) * PERIOD
        made = [np.interp(b - dead, grid, w) - np.interp(a - dead, grid, w) for w in way.T]
        return np.asarray(speed - np.stack(made, axis=1) / (b - a)[:, None])

    def cost(p: Array) -> float:
        lag, dead = math.exp(float(p[0])), max(float(p[1]), 0.0)
        share = np.mean(left(lag, dead) ** 2, axis=0) / power
        return float(np.sum(share[told]))

    # lag and dead time look alike in slow motion: a dead time must earn its place
    alone = minimize_scalar(
        lambda x: cost(np.array([x, 0.0])), bounds=(math.log(0.01), math.log(3.0)), method="bounded"
    )
    _, lag, dead = min((cost(np.array([math.log(x), d])), x, d) for x in LAGS for d in DEAD)
    found = minimize(
        cost,
        [math.log(lag), dead],
        method="Nelder-Mead",
        options={
            "xatol": 1e-3,
            "initial_simplex": [
                [math.log(lag), dead],
                [math.log(lag) + 0.2, dead],
                [math.log(lag), dead + 0.02],
            ],
        },
    )
    least, lag, dead = float(found.fun), math.exp(float(found.x[0])), max(float(found.x[1]), 0.0)
    if least > EARNED * float(alone.fun):
        least, lag, dead = float(alone.fun), math.exp(float(alone.x)), 0.0
    explained = 1.0 - least / int(told.sum())
    if explained < EXPLAINED:
        why = f"commands explain only {100 * max(explained, 0.0):.0f} % of the motion"
        return Drive(untold(why), untold(why), explained=explained)
    rounding = 2.0 * (np.array(resolution) ** 2 / 12.0) / float(np.median(b - a)) ** 2
    wild = np.maximum(np.var(left(lag, dead), axis=0) - rounding, 0.0)
    gain = lag * math.sqrt(correlation / (correlation + lag))
    x, y, w = (np.sqrt(wild) / gain).tolist()
    seconds = float(b[-1] - a[0])
    noise = (1.0 - explained) / max(seconds / correlation, 1.0)  # neighbours are alike

    def sigma(step: tuple[float, float]) -> float:
        apart = left(lag + step[0], dead + step[1]) - left(lag, dead)
        slope = float(np.mean((apart**2 / power)[:, told])) / sum(step) ** 2
        return math.sqrt(noise / max(slope, 1e-9))

    return Drive(
        Figure(lag, sigma((0.01, 0.0))), Figure(dead, sigma((0.0, 0.01))), (x, y, w), explained
    )


def accelerations(start: Array, end: Array, steps: Array, noise: Array) -> tuple[float, ...]:
    """Acceleration along the axes of B, root mean square (3) [m/s^2, m/s^2, rad/s^2].

    Args:
        start, end: of steps (n,) [s].
        steps: along B (n, 3) [m, m, rad].
        noise: variance of one reading of the pose (3).
    """
    n = max(round(SMOOTH / float(np.median(end - start))), 1)
    whole = len(steps) // n * n
    if whole < 4 * n:
        return (0.0, 0.0, 0.0)
    way = steps[:whole].reshape(-1, n, 3).sum(axis=1)
    length = (end - start)[:whole].reshape(-1, n).sum(axis=1)
    speed = way / length[:, None]
    apart = 0.5 * (length[1:] + length[:-1])[:, None]
    a = np.diff(speed, axis=0) / apart
    # of a difference of two neighbouring speeds: the reading between them counts twice
    random = 6.0 * noise / SMOOTH**4
    return tuple(np.sqrt(np.maximum(np.mean(a**2, axis=0) - random, 0.0)).tolist())
