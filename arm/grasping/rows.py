"""Rows of the objectives of the grasp: joint rates of both arms, (m, 14), in B.

Each objective speaks for both palms at once (Platt et al., section III-A.3). A palm that it has
nothing to say about gives no rows, so that those below have its freedom.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Rows
from arm.grasping.model import JOINTS

Array = NDArray[np.float64]


NOTHING = Rows(np.zeros((0, JOINTS)), np.zeros(0), 0.0)


def stack(rows: list[Array], rates: list[float]) -> Rows:
    """Rows of both palms; inactive if there are none."""
    if not rows:
        return NOTHING
    return Rows(np.array(rows), np.array(rates))
