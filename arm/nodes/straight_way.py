"""What every way to a point shares: straight in one frame, rest to rest, tool turning along."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.control import Orientation, Position
from arm.control.motion import GAIN
from arm.hds import Event, Parameter, ParameterValue, Quantity
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock
from arm.nodes.conditions import Conditions, Region, State, Values, free, near
from arm.nodes.frames import Frame, about, axis_angle, frame_of, to_board
from arm.nodes.node import TOOL_ON_BOARD, Array, Context, Step
from arm.nodes.profile import Profile

ACCELERATION = 0.3
"""Peak acceleration along the way [m/s^2]."""
SETTLED = 1e-3
"""Finished when the reference is this near to the target [m], ..."""
SETTLED_TURN = 0.01
"""... and turned to within this [rad], ..."""
SETTLE_TIME = 1.0
"""... or this long after it should be: a poor estimate may never let it come near [s]."""
LEVER = 0.3
"""A turn takes as long as a way of this length for each radian [m]."""
UP: Array = np.array([0.0, 0.0, 1.0])
STAY = float("inf")
"""Default of what keeps its value when a program does not give it."""


def point_of(tip: Array, values: Values) -> Array:
    """The target, a coordinate that is not given staying as ``tip`` has it, shape (3,) [m]."""
    given = np.array([float(values[axis]) for axis in ("X", "Y", "Z")])
    return np.where(np.isfinite(given), given, tip)


def at_point(frame: str) -> Region:
    """The goal region of a way in a frame: the pen near its target."""

    def region(state: State, values: Values) -> dict[str, float]:
        return near(state.at(frame) - point_of(state.entered_at(frame), values))

    return region


class StraightWay:
    """A straight way in frame F, which a subclass names, along which the tool stays square.

    Control law: orientation subject to position, both about a target that moves with F. Goal
    region: the reference within ``SETTLED`` and ``SETTLED_TURN`` of the target. Domain: way and
    target within reach and clear of the board; nothing is checked against obstacles.

    Args:
        values: ``X``, ``Y``, ``Z`` in F, infinite to stay; ``Speed`` and ``Timeout``.
    """

    pressing = False
    conditions = Conditions(domain=free)
    frame = "board"

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._values = [float(values[axis]) for axis in ("X", "Y", "Z")]
        self._speed = float(values["Speed"])
        self._clock = Clock(float(values["Timeout"]))

    def orientation(self, context: Context, frame: Frame) -> Array:
        """R_FT to turn to, shape (3, 3)."""
        return TOOL_ON_BOARD

    def target(self, now: Array) -> Array:
        """Where the way leads, in F [m], given where it was asked to be last, shapes (3,)."""
        return np.array(
            [v if np.isfinite(v) else d for v, d in zip(self._values, now, strict=True)]
        )

    def enter(self, context: Context) -> None:
        """Plan from where the tip is; a coordinate that is not given stays."""
        frame = frame_of(self.frame, context)
        on_board = frame_of("board", context)
        asked, _ = on_board.to_ground(context.desired, np.zeros(3))
        self._start = frame.from_ground(context.kinematics.p)
        self._goal = self.target(frame.from_ground(asked))
        self._R_start = frame.R.T @ context.kinematics.R
        self._R_goal = self.orientation(context, frame)
        self._axis, self._angle = axis_angle(self._R_start.T @ self._R_goal)
        self._way = self._goal - self._start
        # one profile for way and turn, along the longer of them
        self._length = max(float(np.linalg.norm(self._way)), LEVER * self._angle, 1e-9)
        self._after = 0.0
        self._profile = Profile(self._length, self._speed, ACCELERATION)
        self._position = Position(np.eye(3))
        self._orientation = Orientation(frame.R @ self._R_start)
        self._objective = self._orientation.subject_to(self._position)

    resume = enter

    def update(self, context: Context) -> Step:
        """Finished at the goal."""
        frame = frame_of(self.frame, context)
        s, v = context.along(self._profile)
        share, rate = s / self._length, v / self._length
        target, velocity = frame.to_ground(self._start + share * self._way, rate * self._way)
        self._position.track(target, velocity)
        # the objective has no rate of its own: aim ahead by what it would lag behind
        ahead = min(share + rate / GAIN, 1.0)
        R_FT = self._R_start.dot(about(self._axis, ahead * self._angle))
        R_OF = about(UP, frame.turn / GAIN).dot(frame.R) if frame.turn else frame.R
        self._orientation.target = R_OF.dot(R_FT)
        event = None
        if self._profile.done:
            self._after += context.dt
            if self._near(context, frame) or self._after > SETTLE_TIME:
                event = "Finished"
        if self._clock.step(context.dt) and event is None:
            event = "Timeout"
        desired, speed = to_board(context, target, velocity)
        left = self._profile.length - s
        measures = {TO_GO.name: left}
        return Step(self._objective, desired, speed, event, measures=measures)

    def _near(self, context: Context, frame: Frame) -> bool:
        """Whether the reference is in the goal region."""
        away = float(np.linalg.norm(frame.from_ground(context.kinematics.p) - self._goal))
        turned = axis_angle(context.kinematics.R.T @ frame.R @ self._R_goal)[1]
        return away < SETTLED and turned < SETTLED_TURN


SPEED = Parameter("Speed", unit="mm/s", lo=0.001, hi=0.5, default=0.1, doc="Along the way.")
ENDING = (SPEED, TIMEOUT)
"""Parameters of every way, after those of its target."""
EVENTS = (Event("Finished", "The tip is at the pose."), TIMEOUT_EVENT)


TO_GO = Quantity("To_go", "mm", "Of the way to the target; a turn counts 0.3 m for each radian.")
"""What a way offers to guards."""


def coordinate(name: str, lo: float, hi: float, doc: str) -> Parameter:
    """A coordinate of the target [m] that stays if it is not given."""
    return Parameter(name, "mm", lo, hi, STAY, f"{doc}; stays if not given.")
