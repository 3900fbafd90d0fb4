"""Random numbers, drawn many at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

BLOCK = 256
"""Rows drawn at a time."""


def normal_rows(
    rng: np.random.Generator, spread: NDArray[np.float64]
) -> Iterator[NDArray[np.float64]]:
    """What ``spread * rng.standard_normal(n)`` would give call by call, shape (n,), without end.

    Args:
        rng: nobody else may draw from it, for it runs ahead of what was handed out.
        spread: standard deviations, shape (n,).
    """
    while True:
        yield from spread * rng.standard_normal((BLOCK, len(spread)))
