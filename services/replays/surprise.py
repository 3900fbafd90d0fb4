"""Pictures of how surprised a filter was: innovations within their band, NIS over time."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from observer.recordings.innovations import Innovations
from services.replays.run import DOF, Replayed, band_of, in_unit
from services.reports.style import DRAWN, ERROR

MOST = 4000
"""Points of a line: more cannot be seen."""
WINDOW = 40
"""Innovations over which NIS is averaged, at least."""
PIECES = 150
"""Pieces that NIS is averaged over, at most."""
DEGREES = 180.0 / np.pi
AXES = {
    "odometry": (("x", None), ("y", None), ("heading", "deg")),
    "speed": (("forward", "m/s"), ("sideways", "m/s"), ("yaw rate", "deg/s")),
    "imu": (("gyro z", "deg/s"), ("accel x", "m/s^2"), ("accel y", "m/s^2")),
}


def innovations(done: Replayed) -> Figure | None:
    """Innovations of every sensor with their three standard deviations."""
    found = done.innovations
    if not found:
        return None
    figure, axes = plt.subplots(
        3, len(found), figsize=(7 * len(found), 8), sharex=True, squeeze=False, layout="constrained"
    )
    for column, (name, i) in enumerate(found.items()):
        for row, (label, unit) in enumerate(AXES[name]):
            _band(axes[row, column], i, row, f"{name}: {label}", unit)
        axes[2, column].set_xlabel("t [s]")
        inside = (np.abs(i.value) <= 3.0 * i.sigma).mean()
        axes[0, column].set_title(
            f"{name}: {100 * inside:.1f} % within 3 sigma (99.7 % is right),"
            f" {int(i.refused.sum())} of {len(i)} refused",
            fontsize=10,
        )
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    figure.suptitle(title_of(done, "innovations, measured minus predicted"))
    return figure


def _band(axis: Any, i: Innovations, row: int, label: str, unit: str | None) -> None:
    value, sigma = i.value[:, row], i.sigma[:, row]
    factor = DEGREES if unit is not None and unit.startswith("deg") else 1.0
    if unit is None:
        factor, unit = in_unit([float(np.percentile(np.abs(value), 99))])
    k = thin(len(i))
    band = 3.0 * factor * sigma[k]
    axis.fill_between(
        i.t[k],
        -band,
        band,
        color="0.85",
        label="3 sigma, as expected (towers: something pushes)",
        lw=0,
    )
    size = 1.5 if len(i) > 1000 else 3.0
    good = ~i.refused
    axis.plot(i.t[good], factor * value[good], ".", color=DRAWN, ms=size, label="used")
    if i.refused.any():
        axis.plot(i.t[~good], factor * value[~good], "x", color=ERROR, ms=5, label="refused")
    reach = 1.5 * max(3.0 * np.median(sigma), float(np.percentile(np.abs(value), 99.5)))
    axis.set_ylim(-factor * reach, factor * reach)
    axis.set_ylabel(f"{label} [{unit}]")


def nis(done: Replayed) -> Figure | None:
    """NIS over time, averaged over pieces, with the band that it should lie in."""
    found = done.innovations
    if not found:
        return None
    figure, axes = plt.subplots(
        len(found), 1, figsize=(12, 3.2 * len(found)), sharex=True, squeeze=False,
        layout="constrained",
    )  # fmt: skip
    for axis, (name, i) in zip(axes[:, 0], found.items(), strict=True):
        count = max(WINDOW, len(i) // PIECES)
        pieces = max(len(i) // count, 1)
        t = np.array([p.mean() for p in np.array_split(i.t, pieces)])
        mean = np.array([p.mean() for p in np.array_split(i.nis, pieces)])
        low, high = band_of(len(i) // pieces)
        axis.axhspan(low, high, color="0.85", lw=0, label=f"95 % band of the mean of {count}")
        axis.axhline(DOF, color="0.5", lw=1)
        axis.plot(t, mean, color=DRAWN, lw=1.2, label=f"{name}: mean {i.nis.mean():.2f}")
        top = max(2.0 * high, 1.2 * float(np.percentile(mean, 97)))
        over = mean > top
        axis.plot(t[over], np.full(over.sum(), 0.97 * top), "^", color=ERROR, ms=5)
        if over.any():
            axis.plot([], [], "^", color=ERROR, label="beyond the picture")
        axis.set(ylabel="NIS", ylim=(0.0, top))
        axis.legend(loc="best", fontsize=9)
    axes[-1, 0].set_xlabel("t [s]")
    figure.suptitle(
        title_of(
            done, "is the filter honest? above the band: too sure of itself; below: too modest"
        )
    )
    return figure


def title_of(done: Replayed, what: str) -> str:
    """Title of a picture."""
    as_is = ", no corrections" if done.used is done.recording else ""
    return f"{done.recording.name}, observer {done.kind}{as_is}: {what}"


def thin(n: int) -> slice:
    """Which of ``n`` points to draw."""
    return slice(None, None, max(1, n // MOST))
