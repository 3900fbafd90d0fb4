"""Whether and when the gyro's bias moved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from observer.recordings.figure import Figure
from observer.recordings.increments import Noise, Turns
from observer.recordings.rest import Stand
from observer.recordings.series import Curve
from services.messages import Array

CERTAIN = 7.0
"""Standard deviations from which a change is one: many instants are tried."""
WORTH = 5e-4
"""Change that is worth saying [rad/s]."""
EVERY = 0.5
"""Instants that are tried [s]."""
TRIED = 200
"""No more than so many at first; then finer about the best."""
EDGE = 3.0
"""Not so near the ends of the log [s]."""
MOST = 3


@dataclass(frozen=True)
class Step:
    """A change of the gyro's bias.

    Attributes:
        at: instant, by the gyro's stamps [s].
        size: by how much it grew [rad/s].
        standing: seen at rest; otherwise it may be the wheels that turned without the gyro.
    """

    at: float
    size: Figure
    standing: bool


def steps_at_rest(stands: list[Stand]) -> list[Step]:
    """Changes from one stand to the next."""
    out = []
    for a, b in pairwise(stands):
        sigma = math.hypot(a.sigma, b.sigma)
        size = b.gyro_bias - a.gyro_bias
        if abs(size) > max(CERTAIN * sigma, WORTH):
            out.append(Step(b.start, Figure(size, sigma), standing=True))
    return out


def steps_in_motion(
    turns: Turns, gyro: Curve, delay: float, noise: Noise, inflation: float
) -> list[Step]:
    """Changes of what the gyro reads beyond the wheels, one after the other.

    Args:
        turns: by wheels.
        gyro: integrated yaw rate [rad].
        delay: of the wheels' stamps [s].
        noise: of the turns.
        inflation: factor on what ``noise`` makes of the standard deviation.
    """
    a, b = turns.start - delay, turns.end - delay
    keep = (a >= gyro.start) & (b <= gyro.end)
    turns = turns.keep(np.asarray(keep))
    if len(turns) < 50:
        return []
    a, b = a[keep], b[keep]
    columns = np.stack([gyro(b) - gyro(a), b - a, turns.turned], axis=1)
    w = noise.whiten(turns, columns)

    def ramps(instants: Array) -> Array:
        """What a bias that steps up at each instant (m,) adds to the turns, whitened (n, m)."""
        up = np.maximum(b[:, None] - instants, 0.0) - np.maximum(a[:, None] - instants, 0.0)
        return noise.whiten(turns, up)

    first, last = float(a[0]) + EDGE, float(b[-1]) - EDGE
    if last <= first:
        return []
    instants = np.linspace(first, last, min(max(round((last - first) / EVERY), 2), TRIED))
    coarse = ramps(instants)
    known, y = w[:, :2], w[:, 2]
    out: list[Step] = []
    for _ in range(MOST):
        k = _best(known, y, coarse)[0]
        width = float(instants[1] - instants[0])
        fine = np.linspace(instants[k] - width, instants[k] + width, 21)
        steps = ramps(fine)
        k, size, gain = _best(known, y, steps)
        q, r = np.linalg.qr(known)
        left = y - q @ (q.T @ y)
        unit = (float(left @ left) - gain) / max(len(y) - known.shape[1] - 1, 1)
        scale = float(np.linalg.solve(r, q.T @ y)[0])
        sigma = abs(size) * math.sqrt(max(unit, 0.0) / max(gain, 1e-300)) * inflation
        if not abs(size) > max(CERTAIN * sigma, WORTH):
            break
        out.append(Step(float(fine[k]), Figure(-size / scale, sigma / abs(scale)), standing=False))
        known = np.column_stack([known, steps[:, k]])
        apart = np.abs(instants - fine[k]) > EDGE
        instants, coarse = instants[apart], coarse[:, apart]
        if len(instants) < 2:
            break
    return sorted(out, key=lambda step: step.at)


def _best(known: Array, y: Array, columns: Array) -> tuple[int, float, float]:
    """Which of the columns (n, m) explains most beyond ``known``: index, factor, squares less."""
    q, _ = np.linalg.qr(known)
    own = columns - q @ (q.T @ columns)
    power = np.sum(own**2, axis=0)
    there = power > 1e-9 * np.sum(columns**2, axis=0) + 1e-12
    size = np.where(there, own.T @ y / np.where(there, power, 1.0), 0.0)
    k = int(np.argmax(size**2 * power))
    return k, float(size[k]), float(size[k] ** 2 * power[k])
