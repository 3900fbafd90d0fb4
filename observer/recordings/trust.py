"""Whether odometry's own heading is to be used, or the gyro's with odometry's steps."""

from __future__ import annotations

import math

from observer.recordings.facts import Diagnosis

OFF = 0.01
"""Scale that differs from one by this is another."""
MINUTE = 60.0
"""[s]"""
WANDERS = math.radians(0.3)
"""Heading that wheels and gyro may part by in a minute, scale aside, to be the same but for the
scale [rad]."""
CLEARLY = 0.8
"""A path must have less than this share of another's error to be preferred for it."""


def trusted(found: Diagnosis) -> tuple[str, str]:
    """``pose`` or ``speed``, and why.

    ``speed`` means: steps of odometry, turned by the gyro.
    """
    if found.wheels is None:
        return "speed", "there is no pose"
    if found.pose is None or found.inertial is None:
        return "pose", "there is no gyro"
    scale = found.pose.scale
    if scale.value is None:
        return "pose", f"the gyro tells nothing of it ({scale.reason})"
    paths = found.paths or {}
    pose, gyro = paths.get("pose", math.nan), paths.get("gyro heading", math.nan)
    off = scale.beyond(1.0, OFF)
    text = f"its heading turns {scale.value:.3f} +- {scale.sigma:.3f} times as far as the gyro"
    if off and gyro < CLEARLY * pose:
        more = f", and under the gyro's heading its path misses the reference by {gyro:.2f} m"
        return "speed", text + more + f" instead of {pose:.2f} m"
    if off and pose < CLEARLY * gyro:
        more = f", yet its path misses the reference by {pose:.2f} m, less than the {gyro:.2f} m"
        return "pose", text + more + " under the gyro's heading"
    wander = math.sqrt(max(found.pose.noise.walk, 0.0) * MINUTE)
    if off and wander > WANDERS:
        more = f" and wanders off it by another {math.degrees(wander):.1f} deg in a minute"
        return "speed", text + more
    if off:
        return "pose", text + ", evenly: a scale mends it"
    return "pose", "its heading agrees with the gyro"
