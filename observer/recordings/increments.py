"""Least squares of turns by wheels on turns by the gyro over the same, shifted, intervals.

A turn by wheels over ``a .. b`` is ``scale * (G(b - lag) - G(a - lag)) + rate (b - a) + noise``
with G the integrated gyro. What is rounded is the pose, so its increments are correlated: each
error counts up in one and down in the next. The noise is taken as ``white`` on the pose plus a
``walk``, both estimated from the residual's correlation at lags zero and one; the increments are
then whitened by the Cholesky factor of that tridiagonal covariance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded, solve_banded

from observer.recordings.series import Curve, Mask, spread
from services.messages import Array

OUTLIER = 8.0
"""Residuals beyond this many spreads are slip or resets and are left out."""


@dataclass(frozen=True)
class Turns:
    """Turns by wheels.

    Attributes:
        start, end: of each interval, by the wheels' stamps, shape (n,) [s].
        turned: shape (n,) [rad].
        chained: whether an interval begins with the reading at which the one before ended, (n,).
    """

    start: Array
    end: Array
    turned: Array
    chained: Mask

    def __len__(self) -> int:
        return len(self.turned)

    def keep(self, mask: Mask) -> Turns:
        """Some of them."""
        chained = self.chained.copy()
        chained[1:] &= mask[:-1]
        return Turns(self.start[mask], self.end[mask], self.turned[mask], chained[mask])


def of_pose(t: Array, heading: Array) -> Turns:
    """Increments of a heading (n,) [rad], continuous, stamped ``t`` (n,) [s]."""
    chained = np.ones(len(t) - 1, dtype=bool)
    chained[0] = False
    return Turns(t[:-1], t[1:], np.diff(heading), chained)


def of_rate(t: Array, rate: Array, over: float, before: float = 0.0) -> Turns:
    """Turns by a yaw rate (n,) [rad/s] that is the mean over ``over`` [s].

    Args:
        t: stamps (n,) [s].
        rate: (n,) [rad/s].
        over: length of the interval [s].
        before: the interval ends this long before the stamp [s]; its middle is at the stamp if
            this is minus half its length.
    """
    end = t - before
    return Turns(end - over, end, rate * over, np.zeros(len(t), dtype=bool))


@dataclass(frozen=True)
class Noise:
    """Of the increments: ``white`` on each reading [rad^2], ``walk`` in between [rad^2/s]."""

    white: float
    walk: float

    def whiten(self, turns: Turns, columns: Array) -> Array:
        """Columns (n, k), turned so that their noise is white, of variance one."""
        length = turns.end - turns.start
        if not turns.chained.any():
            sd = np.sqrt(2.0 * self.white + self.walk * length)
            return np.asarray(columns / sd[:, None])
        band = np.zeros((2, len(turns)))
        band[0] = 2.0 * self.white + self.walk * length
        band[1, :-1] = np.where(turns.chained[1:], -self.white, 0.0)
        return np.asarray(solve_banded((1, 0), cholesky_banded(band, lower=True), columns))

    @classmethod
    def of(cls, turns: Turns, residual: Array, least: Noise) -> Noise:
        """The noise that explains a residual (n,), no less than ``least``."""
        length = float(np.mean(turns.end - turns.start))
        both = turns.chained[1:]
        power = float(np.mean(residual**2))
        white = 0.0
        if both.any():
            white = max(-float(np.mean((residual[1:] * residual[:-1])[both])), 0.0)
            white = min(white, 0.5 * power)
        walk = max(power - 2.0 * white, 0.0) / length
        return cls(max(white, least.white), max(walk, least.walk))


@dataclass(frozen=True)
class Regression:
    """Weighted least squares at one lag.

    Attributes:
        cost: sum of squares of the whitened residual.
        scale: turn by wheels over turn by gyro.
        rate: turning by wheels beyond that [rad/s].
        scale_sigma: standard deviation of ``scale``.
        residual: before whitening, shape (n,) [rad].
        white: after whitening, shape (n,).
    """

    cost: float
    scale: float
    rate: float
    scale_sigma: float
    residual: Array
    white: Array


def regress(turns: Turns, gyro: Curve, lag: float, noise: Noise) -> Regression:
    """Fit scale and rate at a lag [s] of the wheels' stamps behind the gyro's."""
    by_gyro = gyro(turns.end - lag) - gyro(turns.start - lag)
    columns = np.stack([by_gyro, turns.end - turns.start, turns.turned], axis=1)
    w = noise.whiten(turns, columns)
    normal = w[:, :2].T @ w[:, :2]
    inverse = np.linalg.pinv(normal, hermitian=True)
    scale, rate = (inverse @ (w[:, :2].T @ w[:, 2])).tolist()
    white = w[:, 2] - w[:, :2] @ [scale, rate]
    cost = float(white @ white)
    sigma = float(np.sqrt(inverse[0, 0] * cost / max(len(white) - 3, 1)))
    residual = turns.turned - columns[:, :2] @ [scale, rate]
    return Regression(cost, scale, rate, sigma, residual, white)


def usual(residual: Array) -> Mask:
    """Which of the residuals (n,) are not wild."""
    near = max(spread(residual), 0.3 * float(np.std(residual)), 1e-12)
    return np.asarray(np.abs(residual - np.median(residual)) < OUTLIER * near)


def bottom(x: Array, y: Array) -> tuple[float, float]:
    """Where the parabola through points has its least value, and its curvature (second derivative).

    Args:
        x: shape (n,), n > 2.
        y: shape (n,).
    """
    middle, width = float(np.mean(x)), float(np.ptp(x))
    c2, c1, _ = np.polyfit((x - middle) / width, y, 2).tolist()
    if c2 <= 0.0:
        return float(x[np.argmin(y)]), 0.0
    return float(middle - 0.5 * c1 / c2 * width), float(2.0 * c2 / width**2)
