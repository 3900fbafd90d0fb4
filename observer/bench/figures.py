"""Figures of an estimated path that need its time axis: drift, delay, roughness."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.signal import welch

from services.messages import Array

Mask = np.ndarray[Any, np.dtype[np.bool_]]
Indices = np.ndarray[Any, np.dtype[np.int64]]

SHIFTS = np.arange(-40, 201)
"""Shifts tried for the latency, in samples."""
SEGMENT = 1024
"""Samples per segment of the spectrum."""
CUTOFF = 20.0
"""Power above this is counted [Hz]."""


def pieces(mask: Mask) -> list[slice]:
    """Contiguous stretches where ``mask`` (n,) is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def relative_error(pose: Array, truth: Array, lag: int) -> Array:
    """Error of the motion over ``lag`` samples, seen from where it began, (n - lag) [m].

    The displacement from each sample to the one ``lag`` later, in B at the first, against the
    same of the truth (relative pose error; Sturm et al. 2012). Blind to where and how O lies.

    Args:
        pose: X_OB estimated, (n, 3).
        truth: X_OB, (n, 3).
        lag: samples, less than n.
    """

    def moved(x: Array) -> Array:
        d, a = x[lag:, :2] - x[:-lag, :2], x[:-lag, 2]
        c, s = np.cos(a), np.sin(a)
        return np.stack([c * d[:, 0] + s * d[:, 1], -s * d[:, 0] + c * d[:, 1]], axis=1)

    return np.asarray(np.linalg.norm(moved(pose) - moved(truth), axis=1))


def shift_costs(position: Array, truth: Array, index: Indices, mask: Mask) -> Array:
    """Squared error against the truth of ``SHIFTS`` samples before, summed, (len(SHIFTS),).

    Args:
        position: estimated (n, 2) [m].
        truth: (m, 2) [m], on a grid of its own.
        index: of each estimate in the truth, (n,).
        mask: which estimates count, (n,).
    """
    usable = mask & (index >= SHIFTS[-1]) & (index < len(truth) + SHIFTS[0])
    at, estimated = index[usable], position[usable]
    return np.array([float(np.sum((estimated - truth[at - s]) ** 2)) for s in SHIFTS])


def best_shift(costs: Array) -> float | None:
    """Shift at which `shift_costs` is least, between samples by a parabola; None at an end.

    Positive: the estimate is late by so many samples.
    """
    k = int(np.argmin(costs))
    if not 0 < k < len(costs) - 1:
        return None
    before, least, after = costs[k - 1 : k + 2]
    bend = before - 2.0 * least + after
    return float(SHIFTS[k] + (0.5 * (before - after) / bend if bend > 0 else 0.0))


def power_above(error: Array, rate: float) -> Array | None:
    """Power of an error above ``CUTOFF``, per column (m,) [unit^2].

    Welch's periodogram (Hann window, segments of ``SEGMENT`` samples overlapping by half, the mean
    of each removed), its density summed from ``CUTOFF`` to half the rate.

    Args:
        error: (n, m).
        rate: of the samples [Hz].

    Returns:
        None if there is less than one segment.
    """
    if len(error) < SEGMENT:
        return None
    f, density = welch(error, rate, nperseg=SEGMENT, axis=0)
    return np.asarray(np.sum(density[f >= CUTOFF], axis=0) * (f[1] - f[0]))


def detections(
    flag: Mask, t: Array, starts: tuple[float, ...], within: float
) -> tuple[list[float], Mask]:
    """How long after each start a flag was up, and where else it rose.

    Args:
        flag: (n,).
        t: (n,) [s].
        starts: instants of what is to be flagged [s].
        within: a flag that rises no later than this after a start belongs to it [s].

    Returns:
        Delays [s], inf where it was not flagged in time; mask (n,) of rises that belong to none.
    """
    alone = flag & ~np.concatenate([[False], flag[:-1]])
    delays = []
    for start in starts:
        during = (t >= start) & (t < start + within)
        up = t[flag & during]
        delays.append(float(up[0] - start) if len(up) else math.inf)
        alone &= ~during
    return delays, alone
