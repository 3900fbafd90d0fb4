"""Parameters that driving nodes share."""

from __future__ import annotations

import math

from arm.hds import Parameter

SPEED = Parameter(
    "Speed", "m/s", lo=0.01, hi=5.0, default=math.inf, doc="At most, below the platform's own."
)
TOLERANCE = Parameter("Tolerance", "mm", lo=0.001, hi=1.0, default=0.02, doc="Of the distance.")
TURN_TOLERANCE = Parameter(
    "Turn_tolerance", "deg", lo=0.001, hi=1.0, default=math.radians(1.0), doc="Of the heading."
)
