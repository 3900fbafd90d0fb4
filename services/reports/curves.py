"""Sampled curves: what lies between samples, how far from a path, how round."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HOLE = 0.1
"""Between samples further apart than this nothing is known: who took them was gone [s]."""


def known(t: Array, ts: Array) -> NDArray[np.bool_]:
    """Whether instants (n,) [s] lie among samples at ts (m,), and not in a hole between them."""
    if len(ts) == 0:
        return np.zeros(len(t), dtype=bool)
    after = np.searchsorted(ts, t, side="left").clip(0, len(ts) - 1)
    before = np.searchsorted(ts, t, side="right").clip(1, len(ts)) - 1
    inside = (t >= ts[0]) & (t <= ts[-1])
    return np.asarray(inside & (ts[after] - ts[before] <= HOLE))


def broken(t: Array, *columns: Array, hole: float = HOLE) -> tuple[Array, ...]:
    """Samples at t (n,) and their columns (n, ...), with NaN in every hole: a line breaks there."""
    after = np.flatnonzero(np.diff(t) > hole) + 1
    return tuple(np.insert(np.asarray(c, float), after, np.nan, axis=0) for c in (t, *columns))


def distance_to_path(points: Array, path: Array) -> Array:
    """Distance of points (n, 2) to a polyline (m, 2) [m], shape (n,)."""
    if len(path) < 2:
        return np.hypot(*(points - path[0]).T)
    path = path[:: max(1, len(path) // 2000)]
    a, d = path[:-1], np.diff(path, axis=0)
    square = np.maximum((d * d).sum(axis=1), 1e-18)
    out = np.empty(len(points))
    for i in range(0, len(points), 500):  # bounded memory
        p = points[i : i + 500, None, :] - a[None]
        along = np.clip((p * d).sum(axis=2) / square, 0.0, 1.0)
        gap = p - along[:, :, None] * d
        out[i : i + 500] = np.sqrt((gap * gap).sum(axis=2).min(axis=1))
    return out


def axis_ratio(points: Array) -> float:
    """Minor over major axis of the ellipse nearest to points (n, 2) on a near-circle.

    Fits r(angle) = r0 + a cos 2angle + b sin 2angle about the centre of the best circle.
    """
    A = np.column_stack([2 * points, np.ones(len(points))])
    centre = np.linalg.lstsq(A, (points**2).sum(axis=1), rcond=None)[0][:2]
    d = points - centre
    angle = np.arctan2(d[:, 1], d[:, 0])
    B = np.column_stack([np.ones(len(d)), np.cos(2 * angle), np.sin(2 * angle)])
    r0, a, b = np.linalg.lstsq(B, np.hypot(d[:, 0], d[:, 1]), rcond=None)[0]
    squeeze = np.hypot(a, b)
    return float((r0 - squeeze) / (r0 + squeeze))


def hermite(t: Array, ts: Array, values: Array, rates: Array) -> Array:
    """Cubic interpolation at t (n,) of values (m, k) with rates (m, k) at ts (m,), shape (n, k)."""
    i = np.clip(np.searchsorted(ts, t, side="right") - 1, 0, max(len(ts) - 2, 0))
    if len(ts) < 2:
        return np.repeat(values[:1], len(t), axis=0)
    h = np.maximum(ts[i + 1] - ts[i], 1e-9)[:, None]
    x = np.clip((t - ts[i])[:, None] / h, 0.0, 1.0)
    return (
        (1 + 2 * x) * (1 - x) ** 2 * values[i]
        + x * (1 - x) ** 2 * h * rates[i]
        + x * x * (3 - 2 * x) * values[i + 1]
        + x * x * (x - 1) * h * rates[i + 1]
    )


def rms(x: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(x)))) if len(x) else 0.0
