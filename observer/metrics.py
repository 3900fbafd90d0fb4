"""Figures of an estimate against truth: error, consistency, smoothness."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

from services.messages import Array


def rms(error: Array) -> float:
    """Root mean square of an error series: (n,) or, with the norm of each row, (n, m)."""
    e = np.asarray(error, dtype=np.float64)
    squares = e * e if e.ndim == 1 else np.sum(e * e, axis=1)
    return math.sqrt(float(np.mean(squares)))


def nees(error: Array, covariance: Array) -> Array:
    """Normalised estimation error squared, e' P^-1 e, of (n, m) errors and (n, m, m): (n,).

    Its mean is m if the covariance tells the truth (Bar-Shalom, Estimation with Applications).

    Raises:
        numpy.linalg.LinAlgError: a covariance is singular.
    """
    solved = np.linalg.solve(covariance, np.asarray(error)[..., None])[..., 0]
    return np.asarray(np.sum(error * solved, axis=-1))


def nis(innovation: Array, covariance: Array) -> float:
    """Normalised innovation squared, y' S^-1 y, of (m,) and (m, m)."""
    return float(innovation @ np.linalg.solve(covariance, innovation))


def chi2_quantile(p: float, dof: float) -> float:
    """Quantile of chi-square by Wilson and Hilferty's cube (within 1 % for 0.01 < p, dof >= 3)."""
    k = 2.0 / (9.0 * dof)
    return dof * max(0.0, 1.0 - k + NormalDist().inv_cdf(p) * math.sqrt(k)) ** 3


def chi2_band(dof: int, runs: int, probability: float = 0.95) -> tuple[float, float]:
    """Band in which the mean of ``runs`` independent chi-square values of ``dof`` lies."""
    tail = 0.5 * (1.0 - probability)
    total = dof * runs
    return chi2_quantile(tail, total) / runs, chi2_quantile(1.0 - tail, total) / runs


def largest_step(pose: Array, truth: Array) -> tuple[float, float]:
    """Largest change per sample beyond the true motion: translation [m] and heading [rad].

    Args:
        pose: estimated (n, 3), heading continuous.
        truth: (n, 3) at the same instants.
    """
    d = np.diff(np.asarray(pose) - np.asarray(truth), axis=0)
    return float(np.max(np.hypot(d[:, 0], d[:, 1]))), float(np.max(np.abs(d[:, 2])))


def jitter(velocity: Array, truth: Array, period: float, cutoff: float = 10.0) -> Array:
    """RMS of the velocity error above ``cutoff`` [Hz], per axis (m,).

    Fast velocity error is what an arm with velocity feed-forward turns into motion of the tool.

    Args:
        velocity: estimated (n, m).
        truth: (n, m).
        period: between samples [s].
        cutoff: corner of the first-order high-pass [Hz].
    """
    error = np.asarray(velocity) - np.asarray(truth)
    keep = math.exp(-2.0 * math.pi * cutoff * period)
    low, high = error[0].copy(), np.empty_like(error)
    for k, e in enumerate(error):
        low = keep * low + (1.0 - keep) * e
        high[k] = e - low
    return np.asarray(np.sqrt(np.mean(high * high, axis=0)))
