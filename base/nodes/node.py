"""What a running node of the platform is: it sees a context, votes, and raises events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

from arm.hds import Event, Parameter
from base.approach import Approach
from base.behaviour import Senses, Vote
from base.picture import Picture
from services.messages import Array


@dataclass(frozen=True)
class Context:
    """All a node may know at one step.

    Attributes:
        now: robot time [s].
        dt: time since the node was last asked [s]; time in which it was not asked does not count.
        senses: what behaviours may look at.
        frames: (3,) X_OF of each frame a place can be given in, by its name.
        differential: the platform cannot move sideways.
        approach: how fast the platform may go.
        picture: of the laser, None without one.
    """

    now: float
    dt: float
    senses: Senses
    frames: Mapping[str, Array]
    differential: bool
    approach: Approach
    picture: Picture | None = None

    @property
    def pose(self) -> Array:
        """(3,) X_OB [m, m, rad]."""
        return self.senses.estimate.pose

    def slower(self, speed: float, turn: float) -> Approach:
        """The approach with a node's own limits [m/s, rad/s]; infinite ones change nothing."""
        allowed = self.approach
        return replace(allowed, speed=min(allowed.speed, speed), turn=min(allowed.turn, turn))


@dataclass(frozen=True)
class Step:
    """What a node answers at a step.

    Attributes:
        vote: how it would have the platform move.
        event: raised at this step, or None.
        measures: the quantities of this type's own that guards may look at [SI].
    """

    vote: Vote
    event: str | None = None
    measures: Mapping[str, float] = field(default_factory=dict)


class Control(Protocol):
    """The continuous part of a node. A stop may fall between any two updates."""

    def enter(self, context: Context) -> None:
        """Start here; called once before the first update."""
        ...

    def update(self, context: Context) -> Step:
        """Advance one step."""
        ...


TIMEOUT = Parameter(
    "Timeout",
    unit="s",
    lo=0.1,
    hi=3600,
    default=float("inf"),
    doc="Raise Timeout after this time in the node.",
)
TIMEOUT_EVENT = Event("Timeout", "The node took longer than its Timeout.", needs="Timeout")


class Clock:
    """Counts time in a node and says when it has run out."""

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self._elapsed = 0.0

    def step(self, dt: float) -> bool:
        """Count ``dt`` [s]; True once the limit has passed."""
        self._elapsed += dt
        return self._elapsed >= self._limit - 1e-9
