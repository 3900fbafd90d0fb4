"""What stands and walks around in a world: the ``[[world.obstacle]]`` tables of a scenario.

All of them stand on the floor and are seen from above: the height only says what a camera can
look over.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from deploy.numbers import NonNegative, Positive
from deploy.task import Angle, Documented, Metres

__all__ = ["Box", "Mover", "Obstacle", "Pillar", "Point2", "Wall"]

Point2 = tuple[Metres, Metres]


class Box(Documented):
    """A box, turned any way."""

    kind: Literal["box"] = "box"
    x: Metres
    """Of its middle, in W [m]."""
    y: Metres
    """[m]"""
    yaw: Angle = 0.0
    """From x of W to the box's own x [rad]."""
    length: Positive
    """Along its own x [m]."""
    width: Positive
    """Along its own y [m]."""
    height: Positive = 2.0
    """[m]"""


class Wall(Documented):
    """A straight wall; ``start`` and ``end`` are the ends of its middle line."""

    kind: Literal["wall"] = "wall"
    start: Point2
    """In W [m]."""
    end: Point2
    """In W [m]."""
    thickness: Positive = 0.1
    """[m]"""
    height: Positive = 2.0
    """[m]"""

    @model_validator(mode="after")
    def _has_length(self) -> Wall:
        if math.dist(self.start, self.end) < 1e-3:
            raise ValueError("'start' and 'end' are the same point")
        return self

    def box(self) -> Box:
        """The same as a box."""
        (x0, y0), (x1, y1) = self.start, self.end
        return Box(
            x=(x0 + x1) / 2,
            y=(y0 + y1) / 2,
            yaw=math.atan2(y1 - y0, x1 - x0),
            length=math.dist(self.start, self.end),
            width=self.thickness,
            height=self.height,
        )


class Pillar(Documented):
    """An upright cylinder."""

    kind: Literal["pillar"] = "pillar"
    x: Metres
    """Of its axis, in W [m]."""
    y: Metres
    """[m]"""
    radius: Positive
    """[m]"""
    height: Positive = 2.0
    """[m]"""


class Mover(Documented):
    """A cylinder that goes along straight legs, as a person who looks at a telephone does.

    It stands at the first point until ``start_at``, and at the last one when it has arrived.
    """

    kind: Literal["mover"] = "mover"
    points: Annotated[tuple[Point2, ...], Field(min_length=2)]
    """In W [m]."""
    speed: Annotated[float, Field(gt=0, le=3)]
    """Along the legs [m/s]."""
    start_at: NonNegative = 0.0
    """Robot time at which it sets off [s]."""
    loop: bool = False
    """From the last point straight back to the first, and anew, for ever."""
    radius: Positive = 0.25
    """[m]"""
    height: Positive = 1.7
    """[m]"""

    @model_validator(mode="after")
    def _moves(self) -> Mover:
        if any(math.dist(a, b) < 1e-3 for a, b in zip(self.points, self.points[1:], strict=False)):
            raise ValueError("'points' has the same point twice in a row")
        if self.loop and math.dist(self.points[0], self.points[-1]) < 1e-3:
            raise ValueError("'points' of a loop need not end where they start")
        return self


Obstacle = Annotated[Box | Wall | Pillar | Mover, Field(discriminator="kind")]
