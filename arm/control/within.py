"""Objectives by strict priority, by joints that must keep within the rates they may have."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Rows
from arm.control.priority import Solution, priorities

Array = NDArray[np.float64]

ROUNDING = 1e-9
"""Rates this little beyond what they may be are within it [rad/s]."""


def priorities_within(
    rows: Iterable[Rows], lowest: Array, highest: Array
) -> tuple[Solution, list[int]]:
    """``priorities``, in which no joint leaves the range of its rates.

    A joint that would is held at the end of that range above all objectives, the worst first, and
    the rest is solved anew by the others: what is lowest in priority gives way first. As a joint
    is held at just the rate it asked for when it gets there, rates stay continuous. After
    Flacco, De Luca and Khatib (2012), "Motion control of redundant robots under joint constraints:
    saturation in the null space", without their scaling.

    Args:
        rows: highest priority first.
        lowest, highest: what the rates may be, shape (n,) [rad/s].

    Returns:
        The solution, and the joints that are held in it.
    """
    levels, dof = list(rows), len(lowest)
    joints: list[int] = []
    held: list[Rows] = []
    solution = priorities(levels, dof)
    while len(joints) < dof:
        beyond = np.maximum(lowest - solution.qd, solution.qd - highest)
        worst = int(beyond.argmax())
        if beyond[worst] <= ROUNDING:
            break
        end = lowest if solution.qd[worst] < lowest[worst] else highest
        J = np.zeros((1, dof))
        J[0, worst] = 1.0
        joints.append(worst)
        held.append(Rows(J, end[worst : worst + 1]))
        solution = priorities([*held, *levels], dof)
    return solution, joints
