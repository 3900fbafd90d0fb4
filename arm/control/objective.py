"""One controller of the control basis: an error, a Jacobian and a goal region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from arm.control.algebra import Composable

if TYPE_CHECKING:
    from arm.model import Kinematics

Array = NDArray[np.float64]

GAIN = 8.0
"""Rate at which an error of the reference decays [1/s]."""


@dataclass(slots=True, eq=False)
class Rows:
    """What an objective asks of the joints at one instant: J qd = rate.

    Attributes:
        J: shape (m, n) for n joints.
        rate: shape (m,).
        activation: 1 outside the goal region, falling smoothly to 0 inside it, where the
            objective asks for nothing and takes nothing from those below it.
    """

    J: Array
    rate: Array
    activation: float = 1.0


class Objective(Composable):
    """Lets an error decay: J qd = gain error, outside the goal region.

    A subclass gives ``error`` and ``jacobian``, or ``rows`` outright where more than an error
    counts (a target that moves, a platform that drifts).

    Attributes:
        name: as composites print it.
        gain: decay of the error [1/s].
        tolerance: radius of the goal region, in the unit of the error; 0 is always active.
    """

    gain: float = GAIN
    tolerance: float = 0.0

    def parts(self) -> tuple[Objective, ...]:
        """Itself."""
        return (self,)

    def error(self, kinematics: Kinematics) -> Array:
        """What is still to go, shape (m,)."""
        raise NotImplementedError

    def jacobian(self, kinematics: Kinematics) -> Array:
        """By joint rates, of what the error is the rest of; shape (m, n)."""
        raise NotImplementedError

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """What it asks for at this instant; ``dt`` [s] since the last call."""
        error = self.error(kinematics)
        rate = self.gain * error
        return Rows(self.jacobian(kinematics), rate, edge(error, self.tolerance))

    def at(self, view: Callable[[Any], Kinematics]) -> Objective:
        """The same objective for one of several control points: a palm, a finger tip.

        Args:
            view: picks that point's kinematics, with the Jacobian by all joints, from the whole's.
        """
        return _At(self, view)


class _At(Objective):
    """An objective seen from one control point of many."""

    def __init__(self, objective: Objective, view: Callable[[Any], Kinematics]) -> None:
        self._objective, self._view = objective, view
        self.name = objective.name
        self.gain, self.tolerance = objective.gain, objective.tolerance

    def error(self, kinematics: Kinematics) -> Array:
        """See ``Objective``."""
        return self._objective.error(self._view(kinematics))

    def jacobian(self, kinematics: Kinematics) -> Array:
        """See ``Objective``."""
        return self._objective.jacobian(self._view(kinematics))

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """See ``Objective``."""
        return self._objective.rows(self._view(kinematics), dt)


def edge(error: Array, tolerance: float) -> float:
    """Activation of an objective: 0 within half the tolerance, 1 outside it, smooth between."""
    if tolerance <= 0.0:
        return 1.0
    return smooth(2.0 * float(np.linalg.norm(error)) / tolerance - 1.0)


def smooth(x: float) -> float:
    """0 below 0, 1 above 1, and a cubic without a kink between."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)
