"""What the observer says about itself: covariance in O, validity, reasons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from observer.motion_model import SIZE, Floats
from services.messages import Array

NEVER = 1e6
"""Age of an input that never came [s]; finite, so that it passes the wire."""

REPEATS = 4
"""An axis is taken to rest after so many unchanged odometry values ..."""
CROSSING = 1.0
"""... if at its velocity it takes longer than this to cross a step of the odometry [s]."""


@dataclass(frozen=True)
class Limits:
    """When an estimate must not be used, and when to say what is missing."""

    position: float = 0.02
    """Largest standard deviation of a usable position [m]."""
    heading: float = math.radians(1.0)
    """Largest standard deviation of a usable heading [rad]."""
    odometry_silence: float = 3.0
    """Longest usable time without odometry [s]."""
    odometry_late: float = 0.5
    """Age of odometry that is worth saying [s]."""
    imu_late: float = 0.1
    """Age of the IMU that is worth saying [s]."""


def unknown() -> Array:
    """Covariance (6, 6) that says: nothing is known."""
    return np.diag([1e6] * 6)


def covariance_in_O(
    x: Floats,
    P: Array,
    repeats: Sequence[int],
    resolution: Sequence[float],
    offset: Floats,
    floor: float,
) -> Array:
    """Covariance (6, 6) of (X_OB, V_OB_O) as reported.

    At rest, odometry repeats one rounded value: its error is a constant that no averaging removes,
    yet each repetition makes the filter surer. So on an axis at rest, the reported deviation
    has a floor (a uniform error has q / sqrt(12) = 0.29 q). The filter itself is left
    alone: a floor inside it costs accuracy in heading. What the output has still to feed in counts
    as error too.

    Args:
        x: state (14).
        P: its covariance (14, 14).
        repeats: how often x, y, heading of odometry came unchanged (3).
        resolution: q of x, y [m] and heading [rad].
        offset: filter minus output [m, m, rad].
        floor: least deviation of an axis at rest, in steps of its resolution.
    """
    c, s = math.cos(x[2]), math.sin(x[2])
    vx, vy = x[3], x[4]
    j = np.zeros((6, SIZE))
    j[0, 0] = j[1, 1] = j[2, 2] = j[5, 5] = 1.0
    j[3, 2], j[3, 3], j[3, 4] = -s * vx - c * vy, c, -s
    j[4, 2], j[4, 3], j[4, 4] = c * vx - s * vy, s, c
    out = j @ P @ j.T
    out = 0.5 * (out + out.T)
    velocity = (c * vx - s * vy, s * vx + c * vy, x[5])
    for i in range(3):
        if repeats[i] >= REPEATS and abs(velocity[i]) * CROSSING < resolution[i]:
            out[i, i] = max(out[i, i], (floor * resolution[i]) ** 2)
    e = np.asarray(offset)
    out[:3, :3] += np.outer(e, e)
    return out


def reasons(
    limits: Limits,
    sigma: tuple[float, float],
    odometry_age: float,
    imu_age: float,
    slip: bool,
    jumped: bool = False,
) -> tuple[bool, str]:
    """Whether the estimate may be used, and what there is to say.

    Args:
        limits: see `Limits`.
        sigma: reported standard deviation of position [m] and heading [rad].
        odometry_age: [s].
        imu_age: [s].
        slip: whether odometry contradicts the filter.
        jumped: whether the output was put elsewhere lately.

    Returns:
        (valid, text); what makes it invalid comes first. Empty text: nothing to say.
    """
    fine = sigma[0] <= limits.position and sigma[1] <= limits.heading
    fresh = odometry_age <= limits.odometry_late and imu_age <= limits.imu_late
    if fine and fresh and not (slip or jumped):
        return True, ""
    bad, note = [], []
    if jumped:
        bad.append("pose was reset")
    if not sigma[0] <= limits.position:
        bad.append(f"position uncertain: {sigma[0] * 1e3:.0f} mm")
    if not sigma[1] <= limits.heading:
        bad.append(f"heading uncertain: {math.degrees(sigma[1]):.1f} deg")
    if odometry_age > limits.odometry_silence:
        bad.append("odometry silent")
    elif odometry_age > limits.odometry_late:
        note.append("odometry late")
    if slip:
        note.append("slip")
    if imu_age > limits.imu_late:
        note.append("imu silent")
    return not bad, "; ".join(bad + note)
