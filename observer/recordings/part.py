"""Part of a recording, and which part is worth most."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from observer.recordings.recording import Recording, Samples

GRID = 0.5
"""Speed is looked at over this long [s]."""
ARM = 0.3
"""A turn counts as much as a motion this far from the centre [m]."""


def cut(recording: Recording, start: float, end: float) -> Recording:
    """The part of a recording that was sampled from ``start`` to before ``end`` [s].

    A sensor with fewer than two samples there is None.
    """
    names = ("odometry", "speeds", "imu", "commands", "reference")
    parts: dict[str, Any] = {}
    for name in names:
        samples: Samples | None = getattr(recording, name)
        if samples is not None:
            inside = samples.between(start, end)
            parts[name] = inside if len(inside) > 1 else None
    return replace(recording, **parts)


def liveliest(recording: Recording, seconds: float) -> tuple[float, float]:
    """The part of a recording, so long, in which speed and turning changed most [s].

    Raises:
        ValueError: neither odometry nor wheel speeds.
    """
    wheels = recording.odometry if recording.odometry is not None else recording.speeds
    if wheels is None or len(wheels) < 2:
        raise ValueError(f"{recording.name}: neither odometry nor wheel speeds to go by")
    first, last = float(wheels.t[0]), float(wheels.t[-1])
    if last - first <= seconds:
        return first, float(np.nextafter(last, math.inf))
    grid = np.arange(first, last, GRID)
    values = np.stack([np.interp(grid, wheels.t, column) for column in wheels.values.T], axis=1)
    # of a pose the speed is the difference; what changes it is work for the noise model
    change = np.abs(np.diff(values, 1 if wheels is recording.speeds else 2, axis=0))
    change = change / (1.0 if wheels is recording.speeds else GRID)
    lively = np.concatenate([[0.0], np.cumsum(np.hypot(*change[:, :2].T) + ARM * change[:, 2])])
    at = grid[: len(lively)]
    starts = np.arange(first, last - seconds, 1.0)
    gained = np.interp(starts + seconds, at, lively) - np.interp(starts, at, lively)
    start = float(starts[int(np.argmax(gained))])
    return start, start + seconds
