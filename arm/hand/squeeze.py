"""Forces that squeeze without pushing: internal forces of three fingertips.

They sum to nothing and have no moment wherever the tips are, so a hand that they act through is
not pushed over by its own grip. Forces with directions kept fixed are: their negative stiffness
about the palm, force times width, buckled wrists in the prototype.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def internal(middles: Array, pair: bool) -> Array:
    """Directions and shares of a squeeze, shape (3, 3): forces of the tips on the object.

    Args:
        middles: of the tips, shape (3, 3) [m].
        pair: finger 0 against 1 and 2, which press along the line from their middle to finger 0,
            half as hard each; otherwise all press towards their centroid, by distance.

    Returns:
        Of three: mean length 1. Of a pair: finger 0 has length 1.
    """
    if pair:
        line = 0.5 * (middles[1] + middles[2]) - middles[0]
        line /= np.linalg.norm(line)
        return np.array([line, -0.5 * line, -0.5 * line])
    inward = middles.mean(axis=0) - middles
    return np.asarray(inward / np.linalg.norm(inward, axis=1).mean())
