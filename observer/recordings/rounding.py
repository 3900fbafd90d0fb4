"""The delay of a rounded heading, to a part of what least squares can do.

A rounded heading says more than its value and a variance: the true one lies within half a step. For
each delay of a grid, a filter carries what gyro and wheels may have drifted apart, their scale and
the gyro's bias, and narrows it by every interval (moments of a truncated Gaussian, as the observer
does); the probability of all intervals together is the likelihood of that delay.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr

from observer.recordings.figure import Figure
from observer.recordings.increments import bottom
from observer.recordings.series import Curve
from services.messages import Array

SOFT = (0.1, 0.3)
"""Noise before rounding that is tried, in steps of the rounding."""
WALKS = (1.0, 2.0, 4.0, 16.0)
"""Factors on the walk that are tried."""
GRID = 21
"""Delays that are compared."""
LEAST = 1e-12
"""Probability of an interval that counts as never."""


def refine(
    t: Array,
    heading: Array,
    step: float,
    gyro: Curve,
    lag: float,
    sigma: float,
    scale: float,
    walk: float,
) -> Figure:
    """Delay [s].

    Args:
        t: stamps (n,) [s].
        heading: rounded, continuous (n,) [rad].
        step: of the rounding [rad].
        gyro: integrated yaw rate [rad]; without gaps.
        lag: delay that least squares found [s] ...
        sigma: ... and its standard deviation.
        scale: turn by wheels over turn by gyro.
        walk: how gyro and wheels drift apart, at least [rad^2/s].
    """
    lag, width = float(lag), max(4.0 * sigma, 0.003)
    keep = (t - lag - width >= gyro.start) & (t - lag + width <= gyro.end)
    t, heading = t[keep], heading[keep]
    soft, walks = (g.ravel() for g in np.meshgrid(step * np.array(SOFT), walk * np.array(WALKS)))
    tried = _likelihood(t, heading, step, gyro, np.full(len(soft), lag), scale, soft, walks)
    best = int(np.argmax(tried))
    for _ in range(2):
        lags = lag + np.linspace(-width, width, GRID)
        noise = np.full(GRID, soft[best]), np.full(GRID, walks[best])
        found = _likelihood(t, heading, step, gyro, lags, scale, *noise)
        top = int(np.argmax(found))
        near = slice(max(top - 6, 0), top + 7)
        lag, curvature = bottom(lags[near], -found[near])
        if curvature <= 0.0:
            return Figure(float(lags[top]), sigma)
        lag = min(max(lag, float(lags[0])), float(lags[-1]))
        width = max(3.0 / math.sqrt(curvature), 0.001)
    return Figure(lag, 1.0 / math.sqrt(curvature))


def _likelihood(
    t: Array,
    heading: Array,
    step: float,
    gyro: Curve,
    lags: Array,
    scale: float,
    soft: Array,
    walk: Array,
) -> Array:
    """Log-probability (m,) of all intervals.

    Each for its own lag (m,) [s], noise before rounding (m,) [rad] and walk (m,) [rad^2/s].
    """
    turned = gyro(t[:, None] - lags[None, :])
    turned -= turned[:1]
    apart = heading[:, None] - scale * turned  # (n, m)
    about = turned - turned.mean(axis=0)
    m = len(lags)
    x = np.zeros((m, 3))  # drifted apart [rad], error of the scale, rate [rad/s]
    x[:, 0] = apart[0]
    P = np.zeros((m, 3, 3))
    P[:] = np.diag([step**2, 0.05**2, 0.02**2])
    P[:, 0, 0] += walk
    H = np.ones((m, 3))
    total = np.zeros(m)
    age = t - float(np.mean(t))
    grown = np.diff(t, prepend=t[:1])
    for k in range(len(t)):
        P[:, 0, 0] += grown[k] * walk
        H[:, 1], H[:, 2] = about[k], age[k]
        PH = np.einsum("mij,mj->mi", P, H)
        sd = np.sqrt(np.einsum("mi,mi->m", H, PH) + soft * soft)
        miss = apart[k] - np.einsum("mi,mi->m", H, x)
        side = np.where(miss > 0.0, -1.0, 1.0)  # always in the lower tail, for accuracy
        a, b = (side * miss - 0.5 * step) / sd, (side * miss + 0.5 * step) / sd
        mass = np.maximum(ndtr(b) - ndtr(a), LEAST)
        total += np.log(mass)
        norm = 1.0 / (mass * math.sqrt(2.0 * math.pi))
        fa, fb = np.exp(-0.5 * a * a) * norm, np.exp(-0.5 * b * b) * norm
        shift = np.clip(fa - fb, a, b)
        less = np.clip(1.0 - (1.0 + a * fa - b * fb - shift * shift), 0.0, 1.0)
        K = PH / sd[:, None]
        x += K * (side * shift)[:, None]
        P -= less[:, None, None] * (K[:, :, None] * K[:, None, :])
    return total
