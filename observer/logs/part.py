"""Part of a recording, and which part is worth most."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from observer.logs.recording import Recording, Samples


def cut(recording: Recording, start: float, end: float) -> Recording:
    """The part of a recording that was sampled from ``start`` to before ``end`` [s]."""
    names = ("odometry", "speeds", "imu", "commands", "reference")
    parts: dict[str, Any] = {}
    for name in names:
        samples: Samples | None = getattr(recording, name)
        if samples is not None:
            parts[name] = samples.between(start, end)
    return replace(recording, **parts)


def liveliest(recording: Recording, seconds: float) -> tuple[float, float]:
    """The part of a recording, so long, in which the platform moved and turned most [s].

    Raises:
        ValueError: neither odometry nor wheel speeds.
    """
    if recording.odometry is not None and len(recording.odometry) > 1:
        t = recording.odometry.t
        steps = np.abs(np.diff(recording.odometry.values, axis=0))
    elif recording.speeds is not None and len(recording.speeds) > 1:
        t = recording.speeds.t
        steps = np.abs(recording.speeds.values[1:]) * np.diff(t)[:, None]
    else:
        raise ValueError(f"{recording.name}: neither odometry nor wheel speeds to go by")
    first, last = float(t[0]), float(t[-1])
    if last - first <= seconds:
        return first, np.nextafter(last, math.inf)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]) + 0.5 * steps[:, 2])])
    starts = np.arange(first, last - seconds, 1.0)
    gained = np.interp(starts + seconds, t, way) - np.interp(starts, t, way)
    start = float(starts[int(np.argmax(gained))])
    return start, start + seconds
