"""Solves objectives by strict priority: each in the null space of all above it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs

from arm.control.objective import Rows

Array = NDArray[np.float64]

DAMPING = 0.05
"""Largest damping near a singularity, relative to the size of the projected Jacobian."""
SINGULAR = 0.02
"""Relative manipulability below which damping sets in."""
ROUNDING = 1e-12
"""Keeps a Gram matrix of rank zero positive definite."""
EMPTY = 1e-9
"""A projected Jacobian smaller than this, relative to its own, leaves no freedom to use."""


def solve(rows: Iterable[Rows], dof: int) -> Array:
    """Joint rates that serve the objectives in order of priority.

    qd <- qd + (J N)^# (rate - J qd),  N <- N - (J N)^# (J N), level by level (Platt et al., Eq 4,
    with Jacobian rows in place of one gradient, so that a lower level never moves a higher one).
    Damped near singularities after Nakamura's manipulability rule.

    Args:
        rows: highest priority first.
        dof: number of joints.

    Returns:
        Joint rates, shape (dof,) [rad/s].
    """
    qd = np.zeros(dof)
    N: Array | None = None
    free = float(dof)
    for row in rows:
        if row.activation <= 0.0 or free < 0.5:
            continue
        JN = row.J if N is None else row.J @ N
        size = float(np.vdot(JN, JN))
        share = size / max(float(np.vdot(row.J, row.J)), ROUNDING)
        if share <= EMPTY:
            continue
        inverse = damped_inverse(JN, size, share)
        qd = qd + row.activation * (inverse @ (row.rate - row.J @ qd))
        free -= row.activation * float(np.vdot(inverse.T, JN))  # the rank of what it uses
        if free < 0.5:
            continue  # nothing is left for those below
        used = row.activation * (inverse @ JN)
        N = _identity(dof) - used if N is None else N - N @ used
    return qd


@lru_cache
def _identity(n: int) -> Array:
    return np.eye(n)


def damped_inverse(J: Array, size: float, share: float = 1.0) -> Array:
    """Right pseudo-inverse of J (m, n), damped where J loses rank or the levels above took it.

    Args:
        J: projected Jacobian.
        size: its squared norm.
        share: that, relative to the squared norm before projection.
    """
    m = J.shape[0]
    mean = size / m
    gram = J @ J.T / mean
    factor, failed = dpotrf(gram, lower=1)
    # determinant: 1 for orthogonal rows of equal length, 0 at a singularity
    manipulability = 0.0 if failed else math.prod(factor.diagonal().tolist()) ** 2
    if manipulability < SINGULAR**2:
        damping = DAMPING * (1.0 - manipulability / SINGULAR**2)
        gram.flat[:: m + 1] += damping**2 + ROUNDING
        factor, _ = dpotrf(gram, lower=1)
    if share < SINGULAR**2:  # even a single row can be as good as used up
        damping = DAMPING * (1.0 - share / SINGULAR**2)
        gram.flat[:: m + 1] += damping**2 / share
        factor, _ = dpotrf(gram, lower=1)
    solution: Array = dpotrs(factor, J, lower=1)[0]
    return solution.T / mean
