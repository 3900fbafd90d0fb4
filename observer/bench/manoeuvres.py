"""Commands that make a platform move: V_OB_B [m/s, m/s, rad/s] as a function of time [s]."""

from __future__ import annotations

import math
from collections.abc import Callable

Command = tuple[float, float, float]
Manoeuvre = Callable[[float], Command]


def sway(t: float) -> Command:
    """Sway: y 0.3 m at 1 rad/s, x 0.1 m at 1.3 rad/s, heading 5 deg at 0.8 rad/s."""
    heading = math.radians(5) * math.sin(0.8 * t)
    vx, vy = 0.13 * math.cos(1.3 * t), 0.3 * math.cos(t)
    c, s = math.cos(heading), math.sin(heading)
    return c * vx + s * vy, -s * vx + c * vy, math.radians(5) * 0.8 * math.cos(0.8 * t)


def drive(t: float) -> Command:
    """Ramps of 0.5 m/s^2 to 0.3 m/s along x, with stops, turning slowly."""
    phase = t % 4.0
    v = max(0.0, min(0.3, 0.5 * phase, 0.5 * (2.5 - phase)))
    return v, 0.0, 0.3 * v


def turns(t: float) -> Command:
    """Drive 2 s at 0.3 m/s, then turn by 120 deg in place, left and right in turn."""
    phase = t % 5.0
    if phase < 2.0:
        return max(0.0, min(0.3, 0.5 * phase, 0.5 * (2.0 - phase))), 0.0, 0.0
    angle = math.radians(120) * (1 if t % 10.0 < 5.0 else -1)
    return 0.0, 0.0, angle / 3.0 * (1.0 - math.cos(2.0 * math.pi * (phase - 2.0) / 3.0))


def docking(t: float) -> Command:
    """0.3 m/s until 6 s, braking at 0.15 m/s^2, the last 5 cm at 10 mm/s, then stand."""
    slow = 6.0 + (0.3 - 0.01) / 0.15
    if t >= slow + 5.0:
        return 0.0, 0.0, 0.0
    v = max(0.01, min(0.3, 0.3 - 0.15 * (t - 6.0)))
    return v, 0.1 * v * math.sin(t), 0.2 * v * math.cos(1.5 * t)


def still(t: float) -> Command:
    """No motion."""
    return 0.0, 0.0, 0.0
