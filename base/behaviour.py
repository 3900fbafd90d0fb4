"""What a behaviour is: a small independent thing that says how it would have the platform move.

To add one, write a class with this protocol in a file of its own and give an instance to
``Platform.add``. It knows no other behaviour; the arbiter fuses what they want.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from services.messages import ArmStatus, Array, Bumper, Estimate, Scan, Vision


@dataclass(frozen=True, slots=True)
class Vote:
    """What a behaviour wants.

    Attributes:
        velocity: (3,) V_OB_B wanted [m/s, m/s, rad/s].
        weight: relative to the others' [1]; 0 wants nothing, and only bounds.
        bound: (3,) largest size of each component that it tolerates, whatever the others want;
            None tolerates all.
        limits: (k, 4) half-spaces that the command must stay in, whatever the others want: rows
            (a, b) with a . V_OB_B <= b, b not negative, so that standing still is always allowed;
            None has none.
        reason: what is worth saying, in a few words; empty if nothing is.
    """

    velocity: Array
    weight: float = 1.0
    bound: Array | None = None
    limits: Array | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Senses:
    """What behaviours may look at.

    Attributes:
        estimate: valid and fresh, or behaviours are not asked.
        arm: newest status of the arm, None if it is silent.
        scan: newest of the laser, None before the first or if there is no laser. Its age is for
            the behaviour to judge.
        bumper: newest of the ring of bumpers, likewise.
        vision: newest sighting of each object, by its name.
        command: (3,) what was commanded last, V_OB_B [m/s, m/s, rad/s].
    """

    estimate: Estimate
    arm: ArmStatus | None = None
    scan: Scan | None = None
    bumper: Bumper | None = None
    vision: Mapping[str, Vision] = field(default_factory=dict)
    command: Array = field(default_factory=lambda: np.zeros(3))


class Behaviour(Protocol):
    """One idea of how to move.

    Attributes:
        name: shown with its vote.
    """

    name: str

    @property
    def state(self) -> str:
        """One word on how far it is, for people."""
        ...

    def vote(self, now: float, senses: Senses) -> Vote:
        """What it wants at robot time ``now`` [s]. Calls may pause while the platform stands."""
        ...


STOP = Vote(np.zeros(3), weight=1.0, bound=np.zeros(3))
"""Zero, whatever the others want."""
