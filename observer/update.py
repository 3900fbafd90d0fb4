"""A Kalman update with three values, in half the time of filterpy's.

With the Cholesky factor L of S = H P H' + R and W = P H' L^-T, the gain is K = W L^-1, and the
covariance left, P - W W', is symmetric to the last bit. The inverse factor of a (3, 3) is written
out: numpy's takes longer than all the rest.
"""

from __future__ import annotations

import math

from services.messages import Array


def whitened(S: Array, y: Array) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
    """L^-T of a covariance S = L L' (3, 3), and L^-1 y (3), of which the squares sum to the NIS."""
    (a, _, _), (b, c, _), (d, e, f) = S.tolist()
    i = 1.0 / math.sqrt(a)
    b *= i
    d *= i
    j = 1.0 / math.sqrt(c - b * b)
    e = (e - d * b) * j
    k = 1.0 / math.sqrt(f - d * d - e * e)
    p, q, r = y.tolist()
    p *= i
    q = (q - b * p) * j
    r = (r - d * p - e * q) * k
    return ((i, -b * i * j, (b * j * e - d) * i * k), (0.0, j, -e * j * k), (0.0, 0.0, k)), (
        p,
        q,
        r,
    )


def nis3(S: Array, y: Array) -> float:
    """Normalised innovation squared y' S^-1 y of three values."""
    p, q, r = whitened(S, y)[1]
    return p * p + q * q + r * r


def update3(x: Array, P: Array, y: Array, H: Array, R: Array) -> tuple[Array, Array, float, Array]:
    """State and covariance after a measurement, its NIS and the covariance of its innovation.

    Args:
        x: state (n).
        P: covariance (n, n).
        y: innovation, measured minus expected (3).
        H: derivative of the expected measurement in the state (3, n).
        R: covariance of the measurement's noise (3, 3), positive definite.

    Returns:
        x (n), P (n, n), y' S^-1 y and S (3, 3).
    """
    PHt = P @ H.T
    S = H @ PHt + R
    root, v = whitened(S, y)
    W = PHt @ root
    p, q, r = v
    return x + W @ v, P - W @ W.T, p * p + q * q + r * r, S
