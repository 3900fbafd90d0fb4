"""Objectives, and the one operator that composes them: subject to.

A composite is a list of objectives by priority. ``moment.subject_to(force).subject_to(reach)``
reads like the papers' Φm / Φf / Φreach: reach first, force in its null space, moment in the null
space of both (Platt et al., Eq 3, 4 and 7).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm.model import Kinematics

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rows:
    """What an objective asks of the joints at one instant: J qd = rate.

    Attributes:
        J: shape (m, 6).
        rate: shape (m,).
        activation: 1 outside the goal region, falling smoothly to 0 inside it, where the
            objective asks for nothing and takes nothing from those below it.
    """

    J: Array
    rate: Array
    activation: float = 1.0


class Composable:
    """Gives ``subject_to`` to single objectives and composites alike."""

    def parts(self) -> tuple[Objective, ...]:
        """The single objectives, highest priority first."""
        raise NotImplementedError

    def subject_to(self, other: Composable) -> Composite:
        """This, in the null space of ``other``."""
        return Composite(other.parts() + self.parts())


class Objective(Composable):
    """One controller of the control basis: an error, a Jacobian and a goal region."""

    def parts(self) -> tuple[Objective, ...]:
        """Itself."""
        return (self,)

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """What it asks for at this instant; ``dt`` [s] since the last call."""
        raise NotImplementedError


class Composite(Composable):
    """Objectives by priority, highest first.

    Composition is associative, and an objective that appears twice counts once, at its higher
    priority (Platt et al., Eq 8-11).
    """

    def __init__(self, objectives: Iterable[Objective]) -> None:
        unique: list[Objective] = []
        for objective in objectives:
            if not any(objective is known for known in unique):
                unique.append(objective)
        self._parts = tuple(unique)

    def parts(self) -> tuple[Objective, ...]:
        """The single objectives, highest priority first."""
        return self._parts
