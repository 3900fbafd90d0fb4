"""Solves objectives by strict priority: each in the null space of all above it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv, dposv

from arm.control.objective import Rows

Array = NDArray[np.float64]

DAMPING = 0.05
"""Largest damping near a singularity, relative to the size of the projected Jacobian."""
SINGULAR = 0.05
"""Relative manipulability below which damping sets in."""
ROUNDING = 1e-12
"""Keeps a Gram matrix of rank zero positive definite."""
PLAIN = 0.1
"""Manipulability from which on full rows for all joints are solved at once, without projectors."""
EMPTY = 1e-9
"""A projected Jacobian smaller than this, relative to its own, leaves no freedom to use."""


@dataclass(slots=True, eq=False)
class Solution:
    """What the joints are to do, and how well they can.

    Attributes:
        qd: joint rates, shape (n,) [rad/s].
        manipulability: the smallest of all levels that there were joints enough for, or a lower
            bound of it above ``PLAIN``: 1 is best, below ``SINGULAR`` the rates are damped and
            what was asked for is not met.
    """

    qd: Array
    manipulability: float


def solve(rows: Iterable[Rows], dof: int) -> Array:
    """Joint rates that serve the objectives in order of priority, shape (dof,) [rad/s]."""
    return priorities(rows, dof).qd


def priorities(rows: Iterable[Rows], dof: int) -> Solution:
    """Serve objectives in order of priority.

    qd <- qd + (J N)^# (rate - J qd),  N <- N - (J N)^# (J N), level by level (Platt et al., Eq 4,
    with Jacobian rows in place of one gradient, so that a lower level never moves a higher one).
    Damped near singularities after Nakamura's manipulability rule.

    Args:
        rows: highest priority first.
        dof: number of joints.
    """
    levels = list(rows)
    at_once = _at_once(levels, dof)
    if at_once is not None:
        return at_once
    qd = np.zeros(dof)
    N: Array | None = None
    free, worst = float(dof), 1.0
    for row in levels:
        if row.activation <= 0.0 or free < 0.5:
            continue
        JN = row.J if N is None else row.J.dot(N)
        size = float(np.vdot(JN, JN))
        share = size / max(float(np.vdot(row.J, row.J)), ROUNDING)
        if share <= EMPTY:
            continue
        m = len(row.rate)
        inverse, manipulability = damped_inverse(JN, size, share)
        if m < free + 0.5:  # fewer joints than rows is no fault of the posture
            worst = min(worst, manipulability)
        error = row.rate if N is None else row.rate - row.J.dot(qd)
        qd += row.activation * inverse.dot(error)
        free -= row.activation * float(np.vdot(inverse.T, JN))  # the rank of what it uses
        if free < 0.5:
            continue  # nothing is left for those below
        used = row.activation * inverse.dot(JN)
        N = _identity(dof) - used if N is None else N - N.dot(used)
    return Solution(qd, worst)


def _at_once(levels: list[Rows], dof: int) -> Solution | None:
    """The same where every level can have what it asks for: as many rows as joints, regular.

    The determinant of the stacked rows is the product of the volumes of all projected levels.
    Divided by the volumes that orthogonal rows of their sizes would have, it bounds the
    manipulability of every level, and the share of it that those above have left, from below.
    """
    if not levels or sum([len(row.rate) for row in levels]) != dof:
        return None
    volume = 1.0
    for row in levels:
        if row.activation < 1.0:
            return None
        m = len(row.rate)
        volume *= (float(np.vdot(row.J, row.J)) / m) ** (0.5 * m)
    factors, _, qd, failed = dgesv(
        np.concatenate([row.J for row in levels]), np.concatenate([row.rate for row in levels])
    )
    if failed:
        return None
    bound = abs(math.prod(factors.diagonal().tolist())) / volume
    return Solution(qd, bound) if bound > PLAIN else None


def projector(rows: Iterable[Rows], dof: int) -> Array:
    """Onto the null space of all of ``rows``: N = I - A^# A of the stacked rows, (dof, dof).

    Symmetric and idempotent. Objectives in their goal regions take no part (the rule below Eq 4
    of Platt et al.); one on the edge of it takes part as a whole here.
    """
    stack = [row.J for row in rows if row.activation > 0.0]
    if not stack:
        return _identity(dof).copy()
    A = np.concatenate(stack)
    return _identity(dof) - np.linalg.pinv(A, rcond=1e-9) @ A


@lru_cache
def _identity(n: int) -> Array:
    return np.eye(n)


def damped_inverse(J: Array, size: float, share: float = 1.0) -> tuple[Array, float]:
    """Right pseudo-inverse of J (m, n), damped where J loses rank or the levels above took it.

    Args:
        J: projected Jacobian.
        size: its squared norm.
        share: that, relative to the squared norm before projection.

    Returns:
        The inverse, shape (n, m), and the relative manipulability: 1 for orthogonal rows of equal
        length, 0 where rank is lost.
    """
    used_up = share < SINGULAR**2  # even a single row can be as good as taken
    m = J.shape[0]
    if m == 1:
        extra = _damping(share) ** 2 / share if used_up else 0.0
        return J.T / (size * (1.0 + extra)), 1.0
    mean = size / m
    gram = J.dot(J.T)
    gram /= mean
    factor, solution, failed = dposv(gram, J, lower=1)
    # the determinant, of which the squared norm of the rows is divided out
    manipulability = 0.0 if failed else math.prod(factor.diagonal().tolist())
    singular = failed or manipulability < SINGULAR
    if singular or used_up:
        if singular:
            gram.flat[:: m + 1] += _damping(manipulability**2) ** 2 + ROUNDING
        if used_up:
            gram.flat[:: m + 1] += _damping(share) ** 2 / share
        solution = dposv(gram, J, lower=1)[1]
    inverse: Array = solution.T
    inverse /= mean
    return inverse, manipulability


def _damping(square: float) -> float:
    """Relative damping for the square of a measure that is to stay above ``SINGULAR``."""
    return DAMPING * (1.0 - square / SINGULAR**2)
