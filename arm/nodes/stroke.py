"""What every stroke shares: a path in the board's plane, drawn under pressure control."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from arm.control import ContactObserver, Force, LowPass, Orientation, Position
from arm.hds import Event, Parameter, ParameterValue, Quantity
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock
from arm.nodes.conditions import Conditions, State, Values, able
from arm.nodes.filters import FILTER, filter_cutoff
from arm.nodes.node import TOOL_ON_BOARD, Context, Step
from arm.nodes.profile import Profile, TimeLaw

Array = NDArray[np.float64]

SETTLED = 0.15
"""The pen starts to move when the force has been this near to the set one [N] ..."""
SETTLE_TICKS = 30
"""... for this many ticks,"""
SETTLE_TIME = 0.5
"""or when this time has passed [s]."""
ACCELERATION = 0.1
"""Peak acceleration along a stroke [m/s^2]: low, so that friction reverses gently."""


def pressed(state: State, values: Values) -> dict[str, float]:
    """The pen presses as it should, to within half of it."""
    return {"force": 1.0 - abs(state.force / float(values["Force"]) - 1.0) / 0.5}


def startable(state: State, values: Values) -> dict[str, float]:
    """The force law reaches the board before the pen starts to move, twice over."""
    press = float(values["Force"])
    reached = 0.5 * float(values["FGain"]) * press * SETTLE_TIME
    return {
        **able(state, values),
        "on the board": 1.0 - state.clearance / reached,
        "not pressed hard": 1.0 - state.force / (press + 5.0),
    }


class Stroke:
    """Position along the board subject to force into it; orientation subject to both.

    The pressure settles first, then the pen moves.

    A subclass says where the path goes.

    Args:
        values: ``Speed``, ``Force``, ``FGain``, ``Filter`` and ``Timeout`` of the node.
    """

    pressing = True
    conditions = Conditions(goal=pressed, domain=startable)

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._speed = float(values["Speed"])
        self._press = float(values["Force"])
        self._gain = float(values["FGain"])
        self._cutoff = filter_cutoff(int(values["Filter"]))
        self._filter = LowPass(self._cutoff)
        self._clock = Clock(float(values["Timeout"]))
        self._drawn = 0.0

    def length(self) -> float:
        """Of the path [m]."""
        raise NotImplementedError

    def point(self, s: float) -> tuple[Array, Array]:
        """At arc length ``s`` [m]: offset from the start in S and unit tangent, shapes (2,)."""
        raise NotImplementedError

    def law(self, drawn: float) -> TimeLaw:
        """How the path is run through from rest at arc length ``drawn`` [m]."""
        return Profile(self.length() - drawn, self._speed, ACCELERATION)

    def enter(self, context: Context) -> None:
        """Start the path where the tip was asked to be."""
        self._start = context.desired[:2].copy()
        self._begin(context, 0.0)

    def resume(self, context: Context) -> None:
        """Draw what is left of the path."""
        self._begin(context, self._drawn)

    def _begin(self, context: Context, drawn: float) -> None:
        self._done = drawn
        self._profile = self.law(drawn)
        normal = -context.R_OS[:, 2]
        observer = ContactObserver(context.stiffness, self._cutoff)
        self._force = Force(normal, self._gain, observer=observer)
        self._force.begin(context.force, -context.velocity[2])
        self._steady = 0
        self._wait = Clock(SETTLE_TIME)
        self._moving = False
        self._position = Position(context.R_OS[:, :2].T)
        orientation = Orientation(context.R_OS @ TOOL_ON_BOARD)
        self._objective = orientation.subject_to(self._position).subject_to(self._force)

    def update(self, context: Context) -> Step:
        """Finished at the end of the path."""
        force = self._filter.step(context.force, context.dt)
        self._force.press(self._press, context.force)
        if not self._moving:
            near = abs(force - self._press) < SETTLED
            self._steady = self._steady + 1 if near else 0
            self._moving = self._wait.step(context.dt) or self._steady >= SETTLE_TICKS
        s, speed = context.along(self._profile, self._moving)
        self._drawn = self._done + s
        offset, tangent = self.point(self._drawn)
        desired = context.tip
        desired[:2] = self._start + offset
        velocity = np.zeros(3)
        velocity[:2] = speed * tangent
        self._position.track(*context.on_ground(desired, velocity))
        event = None
        if self._profile.done:
            event = "Finished"
        elif self._clock.step(context.dt):
            event = "Timeout"
        return Step(
            self._objective,
            desired,
            velocity,
            event,
            force=self._press,
            filtered=force,
            drawing=self._moving,
            measures={DRAWN.name: self._drawn},
        )


PARAMETERS = (
    Parameter("Speed", unit="mm/s", lo=0.001, hi=0.3, default=0.04, doc="Along the stroke."),
    Parameter("Force", unit="cN", lo=0.2, hi=20.0, default=1.5, doc="Of the pen on the board."),
    Parameter(
        "FGain",
        unit="m/N/ms",
        lo=0.001,
        hi=0.08,
        default=0.02,
        doc="Speed along the normal per force error.",
    ),
    FILTER,
    TIMEOUT,
)

DRAWN = Quantity("Drawn", "mm", "Length of the line so far.")
"""What a stroke offers to guards."""

EVENTS = (
    Event("Finished", "The stroke is drawn."),
    TIMEOUT_EVENT,
)


def direction(angle: float) -> Array:
    """Unit vector in the board's plane at ``angle`` [rad] from right, counter-clockwise."""
    return np.array([math.cos(angle), math.sin(angle)])
