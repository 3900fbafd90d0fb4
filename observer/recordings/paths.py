"""Odometry against a reference: scale of distance, and whose heading to trust."""

from __future__ import annotations

import math

import numpy as np

from observer.recordings.figure import Figure, untold
from observer.recordings.recording import Samples
from observer.recordings.series import Curve
from services.messages import Array

PIECE = (5.0, 30.0)
"""Length over which wheels and reference are laid on each other [s]: an eighth of all, within."""
WIDE = 4.0
"""A piece must be this many deviations of the reference wide."""


def rebuilt(odometry: Samples, heading: Array, scale: float = 1.0) -> Array:
    """Positions (n, 2) [m] of the same steps, walked under another heading.

    Args:
        odometry: poses.
        heading: continuous (n,) [rad].
        scale: distance by odometry over true distance.
    """
    d = np.diff(odometry.values[:, :2] @ np.array([1.0, 1j])) / scale
    own, other = odometry.values[:, 2], heading
    middle = 0.5 * (other[1:] + other[:-1]) - 0.5 * (own[1:] + own[:-1])
    walked = np.concatenate([[0.0], np.cumsum(d * np.exp(1j * middle))])
    return np.stack([walked.real, walked.imag], axis=1)


def gyro_heading(odometry: Samples, gyro: Curve, delay: float, bias: float) -> Array:
    """Heading (n,) [rad] at odometry's samples as the gyro turned; starts as odometry does."""
    t = np.clip(odometry.t - delay, gyro.start, gyro.end)
    turned = gyro(t) - bias * (t - t[0])
    return np.asarray(odometry.values[0, 2] + turned - turned[0])


def distance_scale(odometry: Samples, reference: Samples, sigma: float) -> Figure:
    """Distance by odometry over distance by reference.

    Args:
        odometry: poses.
        reference: positions.
        sigma: standard deviation of those [m].
    """
    place, there = _beside(odometry, reference)
    if len(there) < 10:
        return untold("the reference has too few positions")
    t = there.t
    shares, weights = [], []
    length = min(max((t[-1] - t[0]) / 8.0, PIECE[0]), PIECE[1])
    for start in np.arange(t[0], t[-1] - 0.5 * length, length):
        piece = (t >= start) & (t < start + length)
        if piece.sum() < 5:
            continue
        o = place[piece] - place[piece].mean()
        r = there.values[piece, :2] @ np.array([1.0, 1j])
        r = r - r.mean()
        width = float(np.vdot(o, o).real)
        if math.sqrt(width / len(o)) < max(WIDE * sigma, 0.05):
            continue
        shares.append(abs(complex(np.vdot(o, r))) / width)
        weights.append(width)
    if len(shares) < 3:
        return untold("too little way, for the reference's accuracy")
    share, weight = np.array(shares), np.array(weights) / np.sum(weights)
    mean = float(weight @ share)
    n = 1.0 / float(weight @ weight)
    spread = math.sqrt(float(weight @ (share - mean) ** 2) / max(n - 1.0, 1.0))
    return Figure(1.0 / mean, spread / mean**2)


def error(odometry: Samples, walked: Array, reference: Samples) -> float:
    """Root mean square distance [m] from the reference after one rigid alignment.

    Args:
        odometry: gives the instants.
        walked: positions (n, 2) at those [m].
        reference: positions.
    """
    moved = Samples(odometry.t, odometry.arrival, walked)
    place, there = _beside(moved, reference)
    if len(there) < 10:
        return math.nan
    r = there.values[:, :2] @ np.array([1.0, 1j])
    o, r = place - place.mean(), r - r.mean()
    turn = complex(np.vdot(o, r))
    turn = turn / abs(turn) if abs(turn) > 0.0 else 1.0 + 0j
    return float(np.sqrt(np.mean(np.abs(r - turn * o) ** 2)))


def _beside(odometry: Samples, reference: Samples) -> tuple[Array, Samples]:
    """Odometry's positions (m,), complex, at the reference's samples, and those samples."""
    there = reference.between(float(odometry.t[0]), float(odometry.t[-1]))
    x = np.interp(there.t, odometry.t, odometry.values[:, 0])
    y = np.interp(there.t, odometry.t, odometry.values[:, 1])
    return np.asarray(x + 1j * y), there
