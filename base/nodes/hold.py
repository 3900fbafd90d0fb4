"""Hold: keep the place where the platform stands."""

from __future__ import annotations

import math
from collections.abc import Mapping

from arm.hds import Event, NodeType, Parameter, ParameterValue
from base.nodes.node import Clock, Context, Step
from base.stand import Stand


class Hold:
    """Stand still for ``Time``, or for ever.

    Control law: zero; a slow return when pushed away. Goal region: where the platform came to
    rest, once ``Time`` is over. Domain: anywhere.
    """

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._clock = Clock(float(values["Time"]))
        self._still = Stand()

    def enter(self, context: Context) -> None:
        """The place is where the platform comes to rest."""

    def update(self, context: Context) -> Step:
        """Timeout after ``Time``."""
        late = self._clock.step(context.dt)
        return Step(self._still.vote(context.now, context.senses), "Timeout" if late else None)


TIME = Parameter("Time", unit="s", lo=0.0, hi=86400, default=math.inf, doc="How long.")

TYPE = NodeType(
    "Hold",
    parameters=(TIME,),
    events=(Event("Timeout", "Time is over.", needs="Time"),),
    doc="Keep the place where the platform stands.",
    make=Hold,
)
