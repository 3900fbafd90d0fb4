"""A diagnosis in plain words: what is so, how bad it is, what to do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from observer.recordings.facts import Diagnosis
from observer.recordings.log import Severity, Verdict
from observer.recordings.verdicts_imu import about_bias, about_mounting, about_noise
from observer.recordings.verdicts_time import about_average, about_delays, about_timing

RIGHT_NIS = 3.0
"""Mean of the normalised innovation squared of three components, if the filter is right."""
NIS_BAND = (0.5, 1.5)
"""Factors on it that are no worry."""
WRITTEN = 2e-5
"""A finer step is that of the digits in the file [m] or [rad]."""
SCATTER = 0.004
"""Scatter of odometry worth a warning [m]."""
OFF = 0.005
"""A scale that differs from one by this is worth a word."""
_ORDER: dict[Severity, int] = {"warning": 0, "note": 1}

__all__ = ["Verdict", "verdicts"]


def verdicts(
    diagnosis: Diagnosis,
    findings: Iterable[Verdict] = (),
    nis: Mapping[str, float] | None = None,
) -> list[Verdict]:
    """Everything worth saying, the worst first.

    Args:
        diagnosis: of a recording.
        findings: of its reader (`observer.recordings.log.Log.findings`).
        nis: mean normalised innovation squared by sensor (``odometry``, ``imu``), three components
            each, if a filter was run.
    """
    parts: Sequence[Callable[[Diagnosis], Iterable[Verdict]]] = (
        about_timing,
        about_delays,
        about_average,
        about_scale,
        about_wheels,
        about_mounting,
        about_bias,
        about_noise,
        about_drive,
    )
    said = [*findings, *(v for part in parts for v in part(diagnosis)), *about_filter(nis or {})]
    return sorted(said, key=lambda verdict: _ORDER[verdict.severity])


def about_scale(found: Diagnosis) -> Iterable[Verdict]:
    """Wheels against gyro and reference, and which of them to use."""
    fit = found.pose
    if fit is not None and fit.scale.value is not None:
        scale = fit.scale
        text = f"odometry turns {fit.scale.value:.3f} +- {scale.sigma:.3f} times as far as the gyro"
        if scale.beyond(1.0, OFF):
            yield Verdict("warning", "yaw-scale", text, "odometry.scale; see which heading to use")
        else:
            yield Verdict("note", "yaw-scale", text)
    if found.distance is not None and found.distance.value is not None:
        scale = found.distance
        text = f"odometry goes {found.distance.value:.3f} +- {scale.sigma:.3f} times as far as the"
        off = scale.beyond(1.0, OFF)
        advice = "odometry.scale: wheels of another size than assumed" if off else ""
        yield Verdict("warning" if off else "note", "distance-scale", text + " reference", advice)
    if found.use == "speed" and found.wheels is not None:
        yield Verdict(
            "warning",
            "use-speed",
            f"odometry's heading is not to be trusted: {found.because}",
            "use its steps as speeds and the gyro for heading (prepare does)",
        )
    elif found.wheels is not None:
        yield Verdict("note", "use-pose", f"odometry's pose can be used: {found.because}")


def about_wheels(found: Diagnosis) -> Iterable[Verdict]:
    """Odometry by itself."""
    wheels = found.wheels
    if wheels is None:
        return
    x, y, heading = wheels.resolution
    parts = []
    if max(x or 0.0, y or 0.0) > WRITTEN:
        parts.append(f"{1e3 * max(x or 0.0, y or 0.0):.3g} mm")
    if (heading or 0.0) > WRITTEN:
        parts.append(f"{math.degrees(heading or 0.0):.3g} deg")
    if parts:
        yield Verdict("note", "rounding", "odometry is rounded to " + " and ".join(parts))
    elif x is not None or heading is not None:
        yield Verdict("note", "rounding", "odometry is not rounded")
    scatter = max(wheels.noise[:2])
    if scatter > max(SCATTER, x or 0.0, y or 0.0):
        yield Verdict(
            "warning",
            "scatter",
            f"odometry scatters by {1e3 * scatter:.0f} mm about a smooth path",
            "it is not sampled when its stamp says, or not evenly",
        )
    for at, far in wheels.leaps[:3]:
        yield Verdict(
            "warning",
            "leap",
            f"odometry leaps by {far:.2f} m at {at:.2f} s",
            "it was reset or corrected from outside; O moves with it",
        )
    if wheels.repeated > 0.1:
        yield Verdict(
            "warning",
            "repeats",
            f"{100 * wheels.repeated:.0f} % of poses repeat the one before in full motion",
            "it is published more often than it is computed; log it at its own rate",
        )


def about_drive(found: Diagnosis) -> Iterable[Verdict]:
    """How commands are answered."""
    if found.drive is None:
        return
    lag, dead = found.drive.lag, found.drive.dead
    if lag.value is None:
        yield Verdict(
            "note", "drive", f"how the drive answers commands cannot be told: {lag.reason}"
        )
        return
    yield Verdict(
        "note",
        "drive",
        f"the drive answers commands with a lag of {lag.value:.2f} s after"
        f" {1e3 * dead.otherwise(0.0):.0f} ms, which explains {100 * found.drive.explained:.0f} %"
        " of the motion",
    )


def about_filter(nis: Mapping[str, float]) -> Iterable[Verdict]:
    """Whether a filter is as sure of itself as it should be."""
    for sensor, mean in nis.items():
        text = f"NIS of {sensor} {mean:.2g} where {RIGHT_NIS:g} is right"
        if not mean <= NIS_BAND[1] * RIGHT_NIS:
            noise = "its noise or the disturbance is stated too small, or its stamps are wrong"
            yield Verdict("warning", "over-confident", f"filter over-confident: {text}", noise)
        elif mean < NIS_BAND[0] * RIGHT_NIS:
            noise = "its noise is stated larger than it is"
            yield Verdict("note", "under-confident", f"filter too modest: {text}", noise)
        else:
            yield Verdict("note", "consistent", f"filter about as sure as it should be: {text}")
