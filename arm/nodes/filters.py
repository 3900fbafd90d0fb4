"""The force filters a program selects by number, as in the framework paper's fragment."""

from __future__ import annotations

import math

from arm.hds import Parameter

CUTOFFS = (math.inf, 200.0, 100.0, 50.0, 20.0, 10.0, 5.0)
"""Cut-off of filter number 0, 1, 2, ... [Hz]; 0 is no filter."""

FILTER = Parameter(
    "Filter",
    lo=0,
    hi=len(CUTOFFS) - 1,
    default=4,
    kind="integer",
    doc="Low-pass of the force: 0 none, 1 to 6 for 200, 100, 50, 20, 10, 5 Hz.",
)


def filter_cutoff(number: int) -> float:
    """Cut-off of a filter [Hz]."""
    return CUTOFFS[number]
