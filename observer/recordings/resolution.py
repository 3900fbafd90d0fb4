"""The step to which values are rounded, told by the values."""

from __future__ import annotations

import numpy as np

from services.messages import Array

GRIDLIKE = 0.05
"""How far a rounded value may lie off its grid, in steps ..."""
SHARE = 0.99
"""... for this share of the values."""
FEWEST = 6
"""Different values without which nothing can be told."""
MOST_PARTS = 4
"""Steps that the two nearest values may be apart."""
FINEST = 1e-9
"""Smaller differences are the arithmetic's."""


def resolution(values: Array) -> float | None:
    """Step of the grid that values lie on.

    Args:
        values: shape (n,).

    Returns:
        The step, in the values' unit; 0 if they lie on none; None if there are too few different
        ones to tell.
    """
    different = np.unique(values)
    if len(different) == 0:
        return None
    apart = np.diff(different)
    apart = apart[apart > FINEST]
    if len(apart) < FEWEST - 1:
        return None
    # neighbours lie a whole number of steps apart: mostly one, where values are dense
    for parts in range(1, MOST_PARTS + 1):
        step = _polished(different, apart, float(np.min(apart)) / parts)
        off = (different - different[0]) / step
        if float(np.mean(np.abs(off - np.round(off)) < GRIDLIKE)) >= SHARE:
            return step
    return 0.0


def _polished(different: Array, apart: Array, step: float) -> float:
    """The step that fits all values: counted over ever longer distances.

    Args:
        different: values, ascending (n,).
        apart: distances of neighbours (n - 1,).
        step: first guess.
    """
    near = apart[apart < 10.5 * step]
    counts = np.round(near / step)
    step = float(counts @ near / (counts @ counts))
    reach, span = 32.0, float(different[-1] - different[0])
    away = different - different[0]
    while reach * step < 4.0 * span:
        counts = np.round(away / step)
        use = (counts <= reach) & (counts > 0)
        if use.any():
            step = float(counts[use] @ away[use] / (counts[use] @ counts[use]))
        reach *= 4.0
    return step
