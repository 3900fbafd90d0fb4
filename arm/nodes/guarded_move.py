"""Guarded_move: go in a direction until something is felt, and not too far."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.control import LowPass, Orientation, Position
from arm.hds import Event, NodeType, Parameter, ParameterValue, Quantity
from arm.hds.timeout import TIMEOUT, TIMEOUT_EVENT, Clock
from arm.nodes.conditions import Conditions, State, Values, free
from arm.nodes.filters import FILTER, filter_cutoff
from arm.nodes.frames import FRAMES, frame_of, to_board
from arm.nodes.node import Array, Context, Step

RAMP = 0.2
"""Time to reach the approach speed [s]."""
TICKS = 4
"""Consecutive ticks above the threshold that make a contact."""


def felt(state: State, values: Values) -> dict[str, float]:
    """Half of the force that was asked for: the filter and a bump come between.

    What a state knows the pen to touch is the board.
    """
    return {"force": state.force / float(values["Force"]) - 0.5}


class GuardedMove:
    """Straight along a direction of frame F until the force against it is felt.

    Control law: orientation (as it is on entry) subject to position along a line at ``Speed``.
    Goal region: filtered force along the direction above ``Force`` for 4 ticks. Domain: nothing
    touched yet; the line within reach.

    Args:
        values: ``Frame``; ``DX``, ``DY``, ``DZ``, the direction in it, of any length; ``Force``
            [N], ``Filter``, ``Speed`` [m/s], ``Distance`` [m], ``Timeout`` [s].

    Raises:
        ValueError: the direction has no length.
    """

    pressing = False
    conditions = Conditions(goal=felt, domain=free, good=("Contact",))

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._frame = str(values["Frame"])
        direction = np.array([float(values[axis]) for axis in ("DX", "DY", "DZ")])
        length = float(np.linalg.norm(direction))
        if length < 1e-9:
            raise ValueError("DX, DY and DZ are all 0, which is no direction")
        self._direction = direction / length
        self._threshold = float(values["Force"])
        self._filter = LowPass(filter_cutoff(int(values["Filter"])))
        self._speed = float(values["Speed"])
        self._distance = float(values["Distance"])
        self._gone = 0.0
        self._clock = Clock(float(values["Timeout"]))

    def orientation(self, context: Context) -> Array:
        """R_OT to keep, shape (3, 3)."""
        return context.kinematics.R.copy()

    def given_up(self, context: Context) -> str | None:
        """The event that says it went too far, or None."""
        if self._gone >= self._distance:
            return "No_Contact"
        return "Out_of_Reach" if context.reach_margin <= 0.0 else None

    def enter(self, context: Context) -> None:
        """Go straight from what was asked for last; an interruption costs no distance."""
        asked = context.p_OS + context.R_OS @ context.desired
        self._point = frame_of(self._frame, context).from_ground(asked)
        self._now = 0.0
        self._above = 0
        self._position = Position(np.eye(3))
        orientation = Orientation(self.orientation(context))
        self._objective = orientation.subject_to(self._position)

    resume = enter

    def update(self, context: Context) -> Step:
        """Contact above ``Force``; the other events when nothing was touched."""
        frame = frame_of(self._frame, context)
        felt = float(frame.R.dot(self._direction).dot(context.contact))
        force = self._filter.step(felt, context.dt)
        self._above = self._above + 1 if force > self._threshold else 0
        self._now = min(self._now + context.dt / RAMP, 1.0)
        speed = self._speed * self._now**2 * (3.0 - 2.0 * self._now)
        self._point = self._point + speed * context.dt * self._direction
        self._gone += speed * context.dt
        target, velocity = frame.to_ground(self._point, speed * self._direction)
        self._position.track(target, velocity)
        event = "Contact" if self._above >= TICKS else self.given_up(context)
        if self._clock.step(context.dt) and event is None:
            event = "Timeout"
        desired, rate = to_board(context, target, velocity)
        measures = {GONE.name: self._gone}
        return Step(self._objective, desired, rate, event, filtered=force, measures=measures)


THRESHOLD = Parameter("Force", "cN", 0.2, 20.0, doc="Filtered force that means contact.")
GONE = Quantity("Gone", "mm", "The way so far.")
SPEED = Parameter("Speed", "mm/s", 0.001, 0.1, 0.02, "Towards the contact.")

TYPE = NodeType(
    "Guarded_move",
    parameters=(
        THRESHOLD,
        FILTER,
        Parameter("DX", "1", -1.0, 1.0, 0.0, "Direction along x of the frame, of any length."),
        Parameter("DY", "1", -1.0, 1.0, 0.0, "Along y."),
        Parameter("DZ", "1", -1.0, 1.0, 0.0, "Along z."),
        Parameter("Frame", kind="word", choices=FRAMES, default="board", doc="Of the direction."),
        Parameter("Distance", "mm", 0.001, 1.0, 0.1, "Gives up after it."),
        SPEED,
        TIMEOUT,
    ),
    events=(
        Event("Contact", "Something is touched."),
        Event("No_Contact", "Nothing was touched along Distance."),
        Event("Out_of_Reach", "The arm is stretched out."),
        TIMEOUT_EVENT,
    ),
    doc="Move in a direction until something is touched.",
    make=GuardedMove,
    quantities=(GONE,),
)
