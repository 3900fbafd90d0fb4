"""What a running node of a hand is, and what guards may look at in any of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from arm.hand.handling import Handling, Scene
from arm.hds import TIME, Quantity
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock

Array = NDArray[np.float64]

__all__ = ["QUANTITIES", "TIMEOUT", "TIMEOUT_EVENT", "Clock", "Control", "Step", "quantities"]


@dataclass
class Step:
    """What a node answers at a tick.

    Attributes:
        event: raised at this tick, or None.
        reason: why, where the event's name does not say it all.
        goal: where the platform is asked to be, X_OB as x, y [m], heading [rad]; None: nowhere.
        stand: the platform is asked to stand where it is.
        residuals: of force and moment, shape (2,), while fingertips slide.
        torque: shape (11,) [N m]; None: what the shared references ask for.
    """

    event: str | None = None
    reason: str = ""
    goal: Array | None = None
    stand: bool = False
    residuals: Array | None = None
    torque: Array | None = None


class Control(Protocol):
    """The continuous part of a node.

    Attributes:
        feels: it keeps what the fingertips feel up to date itself.
    """

    feels: bool

    def enter(self, scene: Scene, hand: Handling) -> None:
        """Start here; called once before the first update."""
        ...

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Advance one tick."""
        ...


QUANTITIES = (
    Quantity("Touching", "1", "How many fingertips touch something."),
    Quantity("Lost", "s", "For how long the tip that is off longest has touched nothing."),
    Quantity("Load", "N", "Weight that the fingertips carry."),
)
"""Offered by every node type besides ``TIME``."""


def quantities(hand: Handling, time: float) -> Mapping[str, float]:
    """The values now [SI]; ``time`` since the node was entered [s]."""
    return {
        TIME.name: time,
        "Touching": float(hand.feel.touching.sum()),
        "Lost": float(hand.off.max()),
        "Load": hand.load,
    }
