"""Small tools for sampled signals: stretches, gaps, integrals that may be read anywhere."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from services.messages import Array

Mask = NDArray[np.bool_]


def runs(mask: Mask) -> list[tuple[int, int]]:
    """Stretches of a mask (n,) that are true, as (first, behind last)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def gaps(t: Array, longest: float) -> list[tuple[float, float]]:
    """Where stamps (n,) [s] are more than ``longest`` [s] apart: (start, end) [s]."""
    at = np.flatnonzero(np.diff(t) > longest)
    return [(float(t[k]), float(t[k + 1])) for k in at]


def touches(start: Array, end: Array, holes: list[tuple[float, float]]) -> Mask:
    """Which of the intervals start (n,) .. end (n,) [s] meet a hole."""
    out = np.zeros(len(start), dtype=bool)
    for a, b in holes:
        out |= (start < b) & (end > a)
    return out


class Curve(Protocol):
    """A quantity that changes over time and may be asked for at any instant of its span."""

    start: float
    end: float

    def __call__(self, t: Array) -> Array:
        """Its value at instants of any shape [s]."""
        ...


class Polyline:
    """Straight lines between samples.

    Args:
        t: instants (n,) [s], increasing.
        values: (n,).
    """

    def __init__(self, t: Array, values: Array) -> None:
        self.start, self.end = float(t[0]), float(t[-1])
        self._t, self._values = t, values

    def __call__(self, t: Array) -> Array:
        """Value at ``t`` (any shape) [s]."""
        return np.asarray(np.interp(t, self._t, self._values))


class Integral:
    """A signal, integrated from its first sample.

    Args:
        t: instants (n,) [s], increasing.
        values: (n,).
    """

    def __init__(self, t: Array, values: Array) -> None:
        self.start, self.end = float(t[0]), float(t[-1])
        self._spline = CubicSpline(t, values).antiderivative()

    def __call__(self, t: Array) -> Array:
        """Integral from the first sample to ``t`` (any shape) [s]."""
        return np.asarray(self._spline(t))


def spread(values: Array) -> float:
    """Standard deviation that a few wild values do not change; 0 of fewer than two."""
    if len(values) < 2:
        return 0.0
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))
