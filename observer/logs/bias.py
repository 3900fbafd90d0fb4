"""Whether and when the gyro's bias moved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from observer.logs.figure import Figure
from observer.logs.increments import Noise, Turns
from observer.logs.rest import Stand
from observer.logs.series import Curve

CERTAIN = 7.0
"""Standard deviations from which a change is one: many instants are tried."""
WORTH = 5e-4
"""Change that is worth saying [rad/s]."""
EVERY = 0.5
"""Instants that are tried [s]."""
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
    instants = np.arange(float(a[0]) + EDGE, float(b[-1]) - EDGE, EVERY)
    known, y = w[:, :2], w[:, 2]
    out: list[Step] = []
    for _ in range(MOST):
        q, r = np.linalg.qr(known)
        left = y - q @ (q.T @ y)
        best: tuple[float, float, float] | None = None
        for at in instants:
            ramp = np.maximum(b - at, 0.0) - np.maximum(a - at, 0.0)
            column = noise.whiten(turns, ramp[:, None])[:, 0]
            own = column - q @ (q.T @ column)
            power = float(own @ own)
            if power < 1e-9 * float(column @ column) + 1e-12:
                continue
            size = float(own @ left) / power
            gain = size * size * power
            if best is None or gain > best[0]:
                best = (gain, at, size)
        if best is None:
            break
        gain, at, size = best
        unit = (float(left @ left) - gain) / max(len(y) - known.shape[1] - 1, 1)
        scale = float(np.linalg.solve(r, q.T @ y)[0])
        sigma = abs(size) * math.sqrt(unit / max(gain, 1e-300)) * inflation
        if abs(size) < max(CERTAIN * sigma, WORTH):
            break
        out.append(Step(float(at), Figure(-size / scale, sigma / abs(scale)), standing=False))
        ramp = np.maximum(b - at, 0.0) - np.maximum(a - at, 0.0)
        known = np.column_stack([known, noise.whiten(turns, ramp[:, None])])
        instants = instants[np.abs(instants - at) > EDGE]
    return sorted(out, key=lambda step: step.at)
