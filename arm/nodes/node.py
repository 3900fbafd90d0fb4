"""What a running node is: it sees a context, sets objectives, and raises events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from arm.control import Composable
    from arm.model import Base, Kinematics

Array = NDArray[np.float64]

TOOL_ON_BOARD: Array = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""R_ST of a pen square on the board: z_T points into it, x_T down."""


class Way(Protocol):
    """Arc length over time, from rest to rest."""

    def step(self, dt: float) -> tuple[float, float]:
        """Advance by ``dt`` [s]; returns arc length [m] and speed [m/s]."""
        ...


@dataclass(slots=True, eq=False)
class Context:
    """All a node may know at one tick.

    Attributes:
        dt: time since the last tick [s].
        kinematics: of the tip at the joint reference.
        base: motion of the platform.
        R_OS: orientation of the board.
        p_OS: position of the board [m].
        force: pressing force on the board along its normal, not filtered [N].
        reach_margin: distance left before the arm is stretched out [m].
        desired: tip position last asked for, p_ST_S [m].
        velocity: and its velocity, shape (3,) [m/s].
        contact: force of the tool on the world in O, not filtered, shape (3,) [N].
        stiffness: of the tool along its axis [N/m].
        pace: share of its speed at which the tool may move along its way: less than 1 near a
            singular posture.
        drift: velocity of the board in O, in which it drifts: x, y [m/s], yaw [rad/s].
    """

    dt: float
    kinematics: Kinematics
    base: Base
    R_OS: Array
    p_OS: Array
    force: float
    reach_margin: float
    desired: Array
    velocity: Array
    contact: Array = field(default_factory=lambda: np.zeros(3))
    stiffness: float = 800.0
    pace: float = 1.0
    drift: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def tip(self) -> Array:
        """Tip position of the reference, p_ST_S [m]."""
        return self.R_OS.T.dot(self.kinematics.p - self.p_OS)

    def on_ground(self, point: Array, velocity: Array) -> tuple[Array, Array]:
        """A point of S and its velocity there, in O with the board's drift: [m], [m/s]."""
        arm = self.R_OS @ point
        vx, vy, w = self.drift.tolist()
        carried = np.array([vx - w * arm[1], vy + w * arm[0], 0.0])
        return self.p_OS + arm, self.R_OS @ velocity + carried

    def along(self, way: Way, moving: bool = True) -> tuple[float, float]:
        """One tick along a way at the present pace: where it is [m], and its speed [m/s]."""
        s, speed = way.step(self.dt * self.pace if moving else 0.0)
        return s, speed * self.pace

    def in_platform(self, p_O: Array) -> Array:
        """A point given in O, in B: [m]."""
        c, s = np.cos(self.base.pose[2]), np.sin(self.base.pose[2])
        x, y = p_O[0] - self.base.pose[0], p_O[1] - self.base.pose[1]
        return np.array([c * x + s * y, c * y - s * x, p_O[2]])


@dataclass(slots=True, eq=False)
class Step:
    """What a node answers at a tick.

    Attributes:
        objective: what the joints are to do; None holds them still.
        desired: tip position asked for, p_ST_S [m].
        velocity: and its velocity, shape (3,) [m/s].
        event: raised at this tick, or None.
        force: pressing force asked for [N], 0 for none.
        filtered: pressing force as the node's filter sees it [N].
        drawing: the pen is moving along a stroke.
        part: which part of the node this is, for a node that changes its objective within; the
            joints' rates fade in when it changes, and every part that draws is a stroke.
        reason: why the event was raised, where its name does not say it all.
        goal: where the platform is asked to be, X_OB as x, y [m], heading [rad]; None asks for
            nothing.
        measures: the quantities of this type's own that guards may look at [SI].
    """

    objective: Composable | None
    desired: Array
    velocity: Array
    event: str | None = None
    force: float = 0.0
    filtered: float = 0.0
    drawing: bool = False
    part: int = 0
    reason: str = ""
    goal: Array | None = None
    measures: Mapping[str, float] = field(default_factory=dict)


class Control(Protocol):
    """The continuous part of a node.

    Attributes:
        pressing: the pen is meant to be on the board.
    """

    pressing: bool

    def enter(self, context: Context) -> None:
        """Start here; called once before the first update."""
        ...

    def update(self, context: Context) -> Step:
        """Advance one tick."""
        ...

    def resume(self, context: Context) -> None:
        """Go on from rest after an interruption; called with the tip back where it was."""
        ...
