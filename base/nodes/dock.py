"""Dock: stand square to a surface at a distance, by the laser."""

from __future__ import annotations

from collections.abc import Mapping

from arm.hds import Event, NodeType, Parameter, ParameterValue
from base.dock import Dock as Behaviour
from base.nodes.node import TIMEOUT, TIMEOUT_EVENT, Clock, Context, Step


class Dock:
    """The behaviour of that name, until it has docked.

    Control law: to the pose in front of a line fitted to the scan, and averaged there. Goal
    region: the distance within 1.5 mm, the direction within 1.5 mrad, as the laser has them.
    Domain: the surface within 35 degrees of ``Bearing``, nothing else nearer there; a platform
    that is holonomic and has a laser.
    """

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._values = values
        self._clock = Clock(float(values["Timeout"]))
        self._dock: Behaviour | None = None

    def enter(self, context: Context) -> None:
        """Look for the surface anew."""
        assert context.picture is not None
        distance, bearing = float(self._values["Distance"]), float(self._values["Bearing"])
        self._dock = Behaviour(distance, bearing, context.picture)

    def update(self, context: Context) -> Step:
        """Docked, or No_surface after two seconds without one."""
        assert self._dock is not None
        late = self._clock.step(context.dt)
        vote = self._dock.vote(context.now, context.senses)
        event = {"docked": "Docked", "blocked": "No_surface"}.get(self._dock.state)
        return Step(vote, event or ("Timeout" if late else None))


TYPE = NodeType(
    "Dock",
    parameters=(
        Parameter("Distance", "m", lo=0.3, hi=5.0, doc="From the middle of the platform."),
        Parameter("Bearing", "deg", lo=-3.15, hi=3.15, default=0.0, doc="Of the surface."),
        TIMEOUT,
    ),
    events=(
        Event("Docked", "The platform stands square to the surface."),
        Event("No_surface", "There is none where it is looked for."),
        TIMEOUT_EVENT,
    ),
    doc="Stand square to a surface at a distance, by the laser.",
    make=Dock,
)
