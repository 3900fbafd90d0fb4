"""Whiteboard_press: hold a force on the board, on the spot, for a time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.hds.timeout import TIMEOUT_EVENT, Clock
from arm.nodes.conditions import Conditions, State, Values, near
from arm.nodes.node import Context, Step
from arm.nodes.stroke import PARAMETERS, Array, Stroke, pressed, startable


def _on_the_spot(state: State, values: Values) -> dict[str, float]:
    return {**pressed(state, values), **near((state.tip - state.entered)[:2])}


class WhiteboardPress(Stroke):
    """A stroke that goes nowhere.

    Control law: as every stroke, orientation subject to position along the board subject to
    force into it. Goal region: the filtered force was within 0.15 N of ``Force`` for 30 ms, or
    0.5 s have passed, and ``Time`` after that. Domain: pen on the board, or just off it.
    """

    conditions = Conditions(goal=_on_the_spot, domain=startable)

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        super().__init__({"Speed": 1.0, **values})
        self._held = Clock(float(values["Time"]))

    def length(self) -> float:
        """None."""
        return 0.0

    def point(self, s: float) -> tuple[Array, Array]:
        """Where it is."""
        return np.zeros(2), np.zeros(2)

    def update(self, context: Context) -> Step:
        """Finished after ``Time`` under the force."""
        step = super().update(context)
        if step.event != "Timeout":
            over = step.drawing and self._held.step(context.dt)
            late = self._clock.step(context.dt) if not over else False
            step.event = "Finished" if over else "Timeout" if late else None
        step.drawing = False  # there is no line to judge
        return step


TYPE = NodeType(
    "Whiteboard_press",
    parameters=(
        Parameter("Time", "s", 0.0, 3600.0, doc="How long, once the force has settled."),
        *(p for p in PARAMETERS if p.name != "Speed"),
    ),
    events=(Event("Finished", "The force was held for Time."), TIMEOUT_EVENT),
    doc="Press on the board for a time.",
    make=WhiteboardPress,
)
