"""Pictures of a replay: the way, what surprised the filter, what it took for bias, lateness."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from observer.recordings.figure import Figure as Told
from observer.recordings.lags import LagCurve, lag_curves
from observer.recordings.score import matched
from services.replays.run import AT_ITS_STAMPS, PICTURES, Replayed, in_unit
from services.replays.surprise import innovations, nis, thin, title_of
from services.reports.style import DRAWN, ERROR, MEANT, save

GREY = "0.45"
COLOURS = {AT_ITS_STAMPS: GREY, "hold": "#8a6fb0", "taylor": "#3a8f6b"}
DEGREES = 180.0 / np.pi


def write_pictures(done: Replayed, folder: Path) -> list[Path]:
    """Draw every picture that there are data for; returns the files."""
    draws = (track, innovations, nis, biases, delay)
    named = zip(PICTURES, draws, strict=True)
    return save(folder, ((name, draw(done)) for name, draw in named))


def _colour(done: Replayed, name: str) -> str:
    return DRAWN if name == done.kind else COLOURS.get(name, GREY)


# -- where it went ---------------------------------------------------------------------------


def track(done: Replayed) -> Figure | None:
    """The way on the floor, and the distance from the reference over time."""
    shown = {n: t for n, t in done.tracks.items() if n in (AT_ITS_STAMPS, done.kind)}
    reference = done.recording.reference if done.scores else None
    if reference is None:
        figure, left = plt.subplots(figsize=(8, 7), layout="constrained")
        right = None
    else:
        figure, (left, right) = plt.subplots(1, 2, figsize=(14, 6.5), layout="constrained")
        k = thin(len(reference))
        dots = {"marker": ".", "ms": 3, "ls": ""} if done.recording.reference_sigma else {"lw": 5}
        left.plot(*reference.values[k, :2].T, color=MEANT, alpha=0.55, label="reference", **dots)
    for name, t in shown.items():
        pose = done.scores[name].alignment.apply(t.pose) if name in done.scores else t.pose
        k = thin(len(t))
        width = 1.4 if name == done.kind else 1.0
        left.plot(*pose[k, :2].T, color=_colour(done, name), lw=width, label=name)
        left.plot(*pose[0, :2], marker="o", color=_colour(done, name), ms=5)
    laid = ", laid onto the reference as one stiff piece" if done.scores else ""
    left.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="the way (dot: start)" + laid)
    left.title.set_fontsize(10)
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3, fontsize=9)
    if right is not None:
        _distances(done, right)
    figure.suptitle(title_of(done, "where the platform went"))
    return figure


def _distances(done: Replayed, axis: Any) -> None:
    """Distance of every track from the reference over time, as running root mean square."""
    reference = done.recording.reference
    assert reference is not None
    factor, unit = in_unit([s.position_rms for s in done.scores.values()])
    over = max(float(done.estimates.t[-1] - done.estimates.t[0]) / 100.0, reference.period)
    for name, twins in _alike(done).items():
        s = done.scores[name]
        t, mine, true = matched(done.tracks[name], reference)
        far = np.hypot(*(s.alignment.apply(mine)[:, :2] - true[:, :2]).T)
        width = max(round(over / reference.period), 1)
        mean = np.convolve(far**2, np.ones(width), "same")
        mean /= np.convolve(np.ones_like(far), np.ones(width), "same")
        k = thin(len(t))
        axis.plot(
            t[k],
            factor * np.sqrt(mean[k]),
            color=_colour(done, name),
            lw=1.6 if name == done.kind else 1.1,
            zorder=3 if name == done.kind else 2,
            label=f"{' = '.join([name, *twins])}: rms {factor * s.position_rms:.3g} {unit}",
        )
    spread = [s.position_rms for s in done.scores.values()]
    if max(spread) > 8.0 * min(spread) > 0.0:
        axis.set_yscale("log")
        axis.set_ylim(bottom=0.2 * factor * min(spread))
        # plain numbers, and enough of them: powers of ten alone leave most of the axis unmarked
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.yaxis.set_minor_formatter(NullFormatter())
    else:
        axis.set_ylim(bottom=0.0)
    if done.recording.reference_sigma:
        noise = factor * np.sqrt(2.0) * done.recording.reference_sigma
        axis.axhline(noise, color=MEANT, lw=1, ls="--", label="noise of the reference, rms")
    axis.set(
        xlabel="t [s]",
        ylabel=f"distance from the reference, rms over {over:.2g} s [{unit}]",
        title="`odometry at its stamps` is read as if it came at once, `hold` from when it came",
    )
    axis.title.set_fontsize(10)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize=9)


def _alike(done: Replayed) -> dict[str, list[str]]:
    """Names of tracks that look different, with those that look the same as them."""
    out: dict[str, list[str]] = {}
    for name, s in done.scores.items():
        for other in out:
            theirs = done.scores[other].position_rms
            if name != done.kind != other and math.isclose(s.position_rms, theirs, rel_tol=0.02):
                out[other].append(name)
                break
        else:
            out[name] = []
    return out


# -- biases, delay ---------------------------------------------------------------------------


def biases(done: Replayed) -> Figure | None:
    """Biases as estimated; slip is shaded."""
    if done.used.imu is None or done.kind in ("hold", "taylor"):
        return None
    e = done.estimates
    k = thin(len(e))
    figure, axes = plt.subplots(2, 1, figsize=(12, 6), sharex=True, layout="constrained")
    axes[0].plot(e.t[k], DEGREES * e.gyro_bias[k], color=DRAWN)
    axes[0].set_ylabel("gyro bias [deg/s]")
    for axis, name, colour in zip((0, 1), "xy", (DRAWN, MEANT), strict=True):
        axes[1].plot(e.t[k], e.accel_bias[k, axis], color=colour, label=f"along {name} of B")
    axes[1].legend(loc="upper right", fontsize=9)
    axes[1].set(ylabel="accelerometer bias [m/s^2]", xlabel="t [s]")
    for axis in axes:
        axis.margins(y=0.15)
        low, high = axis.get_ylim()
        axis.fill_between(
            e.t[k], low, high, where=e.slip[k], color=ERROR, alpha=0.15, lw=0, label="slip reported"
        )
        axis.set_ylim(low, high)
    if e.slip.any():
        axes[0].legend(loc="upper right", fontsize=9)
    figure.suptitle(title_of(done, _taken_off(done)))
    return figure


def _taken_off(done: Replayed) -> str:
    before, after = done.recording.imu, done.used.imu
    inertial = done.diagnosis.inertial
    if before is None or after is None or after is before or inertial is None:
        return "biases as estimated"
    read = float(np.mean(before.values[:, :3], axis=0) @ inertial.mounting.R_BI[2])
    off = DEGREES * (read - float(np.mean(after.values[:, 2])))
    if abs(off) < 1e-4:
        return "biases as estimated"
    return f"biases as estimated, after {off:+.3f} deg/s were taken off the gyro"


def delay(done: Replayed) -> Figure | None:
    """How much of the wheels' turning the gyro leaves unexplained, at every lag."""
    inertial = done.diagnosis.inertial
    if inertial is None:
        return None
    curves = lag_curves(done.recording, inertial.mounting.R_BI)
    if not curves:
        return None
    figure, axis = plt.subplots(figsize=(10, 5), layout="constrained")
    found: dict[str, Told] = {
        "odometry": done.diagnosis.odometry_delay,
        "speeds": done.diagnosis.speeds_delay,
    }
    for curve, colour in zip(curves, (DRAWN, MEANT), strict=False):
        _lag(axis, curve, found[curve.name], colour)
    axis.axvline(0.0, color="0.5", lw=1)
    axis.set(
        xlabel="lag: the wheels' stamps are so much behind the gyro's [ms]",
        ylabel="turning that the gyro does not explain",
        ylim=(0.0, 1.02),
        title="the lowest point is the delay; a shallow curve tells little",
    )
    axis.title.set_fontsize(10)
    axis.legend(fontsize=9)
    figure.suptitle(f"{done.recording.name}: are the wheels late?")
    return figure


def _lag(axis: Any, curve: LagCurve, found: Told, colour: str) -> None:
    label = f"{curve.name}: cannot be told ({found.reason})"
    if found.value is not None:
        label = f"{curve.name}: {1e3 * found.value:+.1f} ms (+- {1e3 * found.sigma:.1f} ms)"
        axis.axvline(1e3 * found.value, color=colour, lw=1, ls="--")
    axis.plot(1e3 * curve.lag, curve.unexplained, color=colour, label=label)
