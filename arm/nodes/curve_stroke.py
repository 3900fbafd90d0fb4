"""A stroke along any curve, as fast as its bends allow."""

from __future__ import annotations

from collections.abc import Mapping

from arm.hds import Parameter, ParameterValue
from arm.nodes.curve import Curve, CurveLaw
from arm.nodes.stroke import Array, Stroke


class CurveStroke(Stroke):
    """From where the pen is, which is where the curve begins.

    Args:
        values: as of ``Stroke``, and ``Acceleration`` [m/s^2].
        curve: to draw.
        law: how it is run through from its beginning, if that is known.
    """

    def __init__(
        self, values: Mapping[str, ParameterValue], curve: Curve, law: CurveLaw | None = None
    ) -> None:
        super().__init__(values)
        self._acceleration = float(values["Acceleration"])
        self._curve = curve
        self._law = law

    def length(self) -> float:
        """Of the curve [m]."""
        return self._curve.length

    def law(self, drawn: float) -> CurveLaw:
        """Slow in bends, at rest in corners."""
        if self._law is not None and drawn == 0.0:
            return self._law.again()
        return CurveLaw(self._curve, self._speed, self._acceleration, drawn)

    def point(self, s: float) -> tuple[Array, Array]:
        """On the curve at arc length ``s``."""
        point, tangent = self._curve.at(s)
        return point - self._curve.points[0], tangent


ACCELERATION = Parameter(
    "Acceleration", "m/s^2", 0.01, 1.0, 0.15, "At most, along the stroke and across it."
)
