"""Random numbers, drawn many at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

BLOCK = 256
"""Rows drawn at a time."""


def normal_rows(rng: np.random.Generator, width: int) -> Iterator[NDArray[np.float64]]:
    """What ``rng.standard_normal(width)`` would give call by call, shape (width,) [1], without end.

    Args:
        rng: nobody else may draw from it, for it runs ahead of what was handed out.
        width: numbers per row.
    """
    while True:
        yield from rng.standard_normal((BLOCK, width))
