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
    least = float(np.min(apart))
    # of a rounded value, neighbours lie one step apart, up to what was lost in writing them down
    near = apart[apart < 1.5 * least]
    if len(near) < 2 and len(apart) > 20:
        return 0.0
    step = float(np.median(near))
    step = _polished(different, step)
    off = (values - values[0]) / step
    off = np.abs(off - np.round(off))
    return step if float(np.mean(off < GRIDLIKE)) >= SHARE else 0.0


def _polished(different: Array, step: float) -> float:
    """The step that fits all values: counted over ever longer distances."""
    reach = 8
    span = float(different[-1] - different[0])
    while reach * step < 4.0 * span:
        counts = np.round((different - different[0]) / step)
        use = counts <= reach
        if use.sum() > 1 and counts[use].any():
            step = float(
                counts[use] @ (different[use] - different[0]) / (counts[use] @ counts[use])
            )
        reach *= 4
    return step
