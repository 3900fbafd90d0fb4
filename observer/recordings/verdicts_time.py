"""Verdicts on stamps: gaps, jitter, delays, averages."""

from __future__ import annotations

from collections.abc import Iterable

from observer.recordings.facts import Diagnosis
from observer.recordings.figure import Figure
from observer.recordings.log import Verdict

LATE = 0.002
"""Delay worth a warning [s]: it costs a robot that reads millimetres a factor of 1.6."""
UNEVEN = 0.2
"""Jitter worth a word, of the period."""
SLOW_TO_COME = 0.05
"""Latency worth a word [s]."""
SLOW_IMU = 50.0
"""[Hz]"""
DRIFTS = 0.005
"""Change of delay over the recording worth a warning [s]."""


def about_timing(found: Diagnosis) -> Iterable[Verdict]:
    """Rates, gaps and latencies."""
    for name in found.short:
        yield Verdict("warning", "too-short", f"{name} has too few samples to tell anything")
    for name, t in found.timing.items():
        if t.gaps:
            start, end = max(t.gaps, key=lambda gap: gap[1] - gap[0])
            times = "once" if len(t.gaps) == 1 else f"{len(t.gaps)} times, longest"
            yield Verdict(
                "warning" if name in ("odometry", "speeds", "imu") else "note",
                "gap",
                f"{name} pauses {times} for {end - start:.2f} s at {start:.2f} s",
            )
        if t.jitter * t.rate > UNEVEN:
            yield Verdict(
                "note",
                "jitter",
                f"{name} is stamped unevenly: {1e3 * t.jitter:.1f} ms rms about"
                f" {1e3 / t.rate:.1f} ms",
                "if samples are taken evenly, stamp them so",
            )
        if t.latency > SLOW_TO_COME:
            yield Verdict(
                "note",
                "latency",
                f"{name} arrives {1e3 * t.latency:.0f} ms after its stamp"
                f" (+- {1e3 * t.latency_spread:.0f} ms)",
            )
        if name == "imu" and t.repeated > 0.05:
            yield Verdict(
                "warning",
                "repeats",
                f"{100 * t.repeated:.0f} % of IMU samples repeat the one before",
                "it is read more often than it measures; log it at its own rate",
            )
        if name == "imu" and t.rate < SLOW_IMU:
            yield Verdict("note", "slow-imu", f"the IMU gives {t.rate:.0f} readings a second")


def about_delays(found: Diagnosis) -> Iterable[Verdict]:
    """Delays against the IMU's stamps."""
    if found.wheels is not None and "imu" in found.timing:
        yield from _delay("odometry", found.odometry_delay)
    averaged = found.average_by_pose or found.average_by_gyro
    if found.speeds is not None and not (averaged is not None and averaged.box.value):
        yield from _delay("speeds", found.speeds_delay)
    fit = found.pose
    if fit is not None and fit.delay.told and fit.drift.value is not None:
        odometry = found.timing["odometry"]
        over = fit.drift.value * (odometry.end - odometry.start)
        if abs(over) > DRIFTS and fit.drift.beyond(0.0, 0.0, 5.0):
            yield Verdict(
                "warning",
                "clock-drift",
                f"the delay of odometry changes by {1e3 * over:+.0f} ms over the recording"
                f" ({1e6 * fit.drift.value:+.0f} parts in a million): two clocks",
                "corrected by prepare; better: stamp both by one clock",
            )


def _delay(table: str, delay: Figure) -> Iterable[Verdict]:
    code = f"{table}-delay"
    name = "odometry" if table == "odometry" else "wheel speed"
    if delay.value is None:
        yield Verdict(
            "warning",
            code,
            f"whether {name} is late cannot be told: {delay.reason}",
            "record 20 s with quick turns to and fro",
        )
        return
    size = f"{1e3 * abs(delay.value):.{0 if abs(delay.value) > 0.05 else 1}f}"
    sigma = f"(+- {1e3 * delay.sigma:.1f} ms)"
    if not delay.beyond(0.0, LATE):
        yield Verdict("note", code, f"{name} is on time: {1e3 * delay.value:+.1f} ms {sigma}")
    elif delay.value > 0.0:
        text = f"{name} is {size} ms late {sigma}: it says what the gyro said so long before"
        yield Verdict("warning", code, text, f"[{table}] delay, or correct its stamps")
    else:
        text = f"{name} is {size} ms ahead of the gyro {sigma}: the IMU's stamps are late"
        yield Verdict("warning", code, text, "[imu] delay, or correct its stamps")


def about_average(found: Diagnosis) -> Iterable[Verdict]:
    """Speeds that are means over the past."""
    by = found.average_by_pose or found.average_by_gyro
    if by is None or not by.box.value or by.delay.value is None:
        return
    source = "pose" if found.average_by_pose is not None else "turning"
    age = by.delay.value
    if found.average_by_gyro is not None:
        age = found.average_by_gyro.delay.otherwise(age)
    yield Verdict(
        "warning",
        "averaged-speed",
        f"speeds are the mean of the {source} over the last {by.box.value:.2f} s:"
        f" {1e3 * age:.0f} ms late and smeared, however fresh their stamps",
        "use poses, or what the drive measures before it averages",
    )
