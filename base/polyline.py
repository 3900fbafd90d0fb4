"""Straight lines and ways made of points."""

from __future__ import annotations

import math

import numpy as np

from services.messages import Array

CELL = 0.05
"""Between points of a way [m]."""
NEXT = 40
"""Of a way as it was found, the platform is still near one of so many first points."""


def clear(start: Array, end: Array, points: Array) -> float:
    """Least distance of points (m, 2) from a straight line [m]; those behind its start are out."""
    along = end - start
    length2 = float(along @ along)
    if length2 < 1e-12:
        return math.inf
    away = points - start
    share = away @ along / length2
    ahead = share > 0
    if not ahead.any():
        return math.inf
    off = away[ahead] - np.minimum(share[ahead], 1.0)[:, None] * along
    return float(np.sqrt((off * off).sum(axis=1).min()))


def line(start: Array, end: Array) -> Array:
    """(n, 2) points of a straight line, a cell apart."""
    count = max(2, math.ceil(float(np.hypot(*(end - start))) / CELL) + 1)
    return start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)


def rest(points: Array, start: Array) -> Array:
    """(n, 2) what is left of a way, from where the platform is now."""
    away = np.hypot(*(points[:NEXT] - start).T)
    left = points[min(int(np.argmin(away)) + 1, len(points) - 1) :]
    return np.vstack([line(start, left[0]), left[1:]])
