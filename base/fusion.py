"""Rules that make one wanted velocity of many votes: a weighted mean, or an optimum under limits.

Both take the weighted mean as what is wanted. They differ in what they do where it is not allowed:
``weighted`` goes slower on the same course, ``optimum`` goes to the nearest velocity allowed, which
slides along what is in the way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import quadprog

from base.behaviour import Vote
from services.messages import Array

_SLACK_COST = 1e4  # of a half-space left by 1 m/s, against a wish missed by 1 m/s
_NONE = np.zeros((0, 4))


def collect(votes: Iterable[Vote], speed: Array) -> tuple[Array, Array, Array]:
    """What is wanted on the whole and what is allowed.

    Args:
        votes: of all behaviours.
        speed: (3,) the platform's own bound.

    Returns:
        (3,) weighted mean of the velocities, zero if nobody wants anything; (3,) bound of each
        component; (k, 4) half-spaces (a, b) with a . V <= b.
    """
    wanted, total, bound, limits = np.zeros(3), 0.0, speed, []
    for vote in votes:
        if vote.weight > 0:
            wanted = wanted + vote.weight * vote.velocity
            total += vote.weight
        if vote.bound is not None:
            bound = np.minimum(bound, np.maximum(vote.bound, 0.0))
        if vote.limits is not None and len(vote.limits):
            limits.append(vote.limits)
    rows = np.vstack(limits) if limits else _NONE
    if len(rows):  # standing still is always allowed
        rows = np.column_stack([rows[:, :3], np.maximum(rows[:, 3], 0.0)])
    return (wanted / total if total > 0 else wanted), bound, rows


def weighted(wanted: Array, bound: Array, limits: Array) -> Array:
    """Shorten x and y together, and the turn by itself, until each is allowed.

    Args:
        wanted: (3,) V_OB_B.
        bound: (3,) largest size of each component.
        limits: (k, 4) half-spaces (a, b).
    """
    size = np.abs(wanted)
    out = wanted.copy()
    scale = min([1.0] + [float(bound[i] / size[i]) for i in (0, 1) if size[i] > bound[i]])
    out[:2] = np.clip(scale * wanted[:2], -bound[:2], bound[:2])
    out[2] = min(max(wanted[2], -bound[2]), bound[2])
    if len(limits):
        along = limits[:, :3] @ out
        over = along > limits[:, 3]
        if over.any():
            out *= float(np.min(limits[over, 3] / along[over]))
    return out


def optimum(wanted: Array, bound: Array, limits: Array) -> Array:
    """The point nearest to ``wanted`` that is allowed; arguments as for ``weighted``.

    That is where the weighted sum of squared distances to all votes is least.
    """
    return nearest(wanted, -bound, bound, limits)


def nearest(wanted: Array, lo: Array, hi: Array, limits: Array) -> Array:
    """The point nearest to ``wanted`` in a box and, as far as the box has such, in half-spaces.

    Args:
        wanted: (3,).
        lo: (3,) of the box, which is never left.
        hi: (3,)
        limits: (k, 4) half-spaces (a, b) with a . V <= b. Where the box has no point in all of
            them, they are left by as little as can be.
    """
    if not len(limits):
        return np.clip(wanted, lo, hi)
    inside = np.clip(wanted, lo, hi)
    if (limits[:, :3] @ inside <= limits[:, 3]).all():
        # of a box, the point nearest is each component clipped, and the half-spaces do not bind
        return inside
    k = len(limits)
    cost = np.diag([1.0, 1.0, 1.0, _SLACK_COST])
    rows = np.zeros((k + 7, 4))
    rows[:k, :3], rows[:k, 3] = -limits[:, :3], 1.0
    rows[k : k + 3, :3], rows[k + 3 : k + 6, :3] = np.eye(3), -np.eye(3)
    rows[k + 6, 3] = 1.0
    least = np.concatenate([-limits[:, 3], lo - 1e-12, -hi - 1e-12, [0.0]])
    try:
        found = quadprog.solve_qp(cost, np.append(inside, 0.0), rows.T, least)[0]
    except ValueError:  # by rounding only: there is always a point
        return np.clip(np.zeros(3), lo, hi)
    return np.clip(found[:3], lo, hi)


RULES: dict[str, Callable[[Array, Array, Array], Array]] = {
    "optimum": optimum,
    "weighted": weighted,
}
