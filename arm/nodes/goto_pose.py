"""Goto_pose: bring the tip to a point over the board, pen square on it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.control import Orientation, Position
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.nodes.node import TIMEOUT, TIMEOUT_EVENT, TOOL_ON_BOARD, Clock, Context, Step
from arm.nodes.profile import Profile

ACCELERATION = 0.3
"""Peak acceleration along the way [m/s^2]."""
SETTLED = 1e-3
"""Finished when the reference is this near to the target [m] ..."""
SETTLE_TIME = 1.0
"""... or this long after it should be: a poor estimate may never let it come near [s]."""


class GotoPose:
    """A straight way in the board's frame."""

    pressing = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._values = [values["X"], values["Y"], values["Z"]]
        self._speed = float(values["Speed"])
        self._clock = Clock(float(values["Timeout"]))

    def enter(self, context: Context) -> None:
        """Plan from where the tip is; a coordinate that is not given stays."""
        self._start = context.tip
        self._goal = np.array(
            [
                float(v) if np.isfinite(float(v)) else d
                for v, d in zip(self._values, context.desired, strict=True)
            ]
        )
        way = self._goal - self._start
        length = float(np.linalg.norm(way))
        self._direction = way / length if length > 0 else np.zeros(3)
        self._after = 0.0
        self._profile = Profile(length, self._speed, ACCELERATION)
        self._position = Position(np.eye(3))
        self._orientation = Orientation(context.R_OS @ TOOL_ON_BOARD)

    resume = enter

    def update(self, context: Context) -> Step:
        """Finished at the goal."""
        s, v = self._profile.step(context.dt)
        desired = self._start + s * self._direction
        velocity = v * self._direction
        self._position.track(context.p_OS + context.R_OS @ desired, context.R_OS @ velocity)
        event = None
        if self._profile.done:
            self._after += context.dt
            near = float(np.linalg.norm(context.tip - self._goal)) < SETTLED
            if near or self._after > SETTLE_TIME:
                event = "Finished"
        if self._clock.step(context.dt) and event is None:
            event = "Timeout"
        return Step(self._orientation.subject_to(self._position), desired, velocity, event)


_STAY = float("inf")

TYPE = NodeType(
    "Goto_pose",
    parameters=(
        Parameter(
            "X",
            unit="mm",
            lo=-1.0,
            hi=1.0,
            default=_STAY,
            doc="Right of the board's origin; stays if not given.",
        ),
        Parameter(
            "Y",
            unit="mm",
            lo=-1.0,
            hi=1.0,
            default=_STAY,
            doc="Above the board's origin; stays if not given.",
        ),
        Parameter(
            "Z",
            unit="mm",
            lo=0.005,
            hi=0.5,
            default=_STAY,
            doc="In front of the board; stays if not given.",
        ),
        Parameter("Speed", unit="mm/s", lo=0.001, hi=0.5, default=0.1, doc="Along the way."),
        TIMEOUT,
    ),
    events=(
        Event("Finished", "The tip is at the pose."),
        TIMEOUT_EVENT,
    ),
    doc="Bring the tip to a point over the board.",
    make=GotoPose,
)
