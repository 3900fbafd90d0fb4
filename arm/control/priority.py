"""Solves objectives by strict priority: each in the null space of all above it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Rows

Array = NDArray[np.float64]

DAMPING = 0.05
"""Largest damping near a singularity, relative to the size of the projected Jacobian."""
SINGULAR = 0.02
"""Relative manipulability below which damping sets in."""
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
    for row in rows:
        if row.activation <= 0.0:
            continue
        JN = row.J if N is None else row.J @ N
        size = float(np.vdot(JN, JN))
        if size <= EMPTY * float(np.vdot(row.J, row.J)):
            continue
        inverse = damped_inverse(JN, size)
        qd = qd + row.activation * (inverse @ (row.rate - row.J @ qd))
        used = row.activation * (inverse @ JN)
        N = np.eye(dof) - used if N is None else N - N @ used
    return qd


def damped_inverse(J: Array, size: float) -> Array:
    """Right pseudo-inverse of J (m, n), damped where J loses rank; ``size`` is its squared norm."""
    m = J.shape[0]
    gram = J @ J.T
    mean = size / m
    # 1 for orthogonal rows of equal length, 0 at a singularity
    manipulability = max(float(np.linalg.det(gram / mean)), 0.0)
    damping = mean * 1e-12
    if manipulability < SINGULAR**2:
        short = 1.0 - manipulability / SINGULAR**2
        damping += mean * (DAMPING * short) ** 2
    gram.flat[:: m + 1] += damping
    return np.linalg.solve(gram, J).T
