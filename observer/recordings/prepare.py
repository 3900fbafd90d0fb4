"""Makes of a recording what the observer can run on: all in B, on one clock, figures filled in."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from deploy.robot import MobileBase, Platform
from deploy.sensors import Imu, Odometry
from observer.recordings.delay import CREEPS, TurnFit
from observer.recordings.drive import steps_in_B
from observer.recordings.facts import Diagnosis
from observer.recordings.figure import Figure, untold
from observer.recordings.frames import in_B
from observer.recordings.log import auto_of
from observer.recordings.recording import Recording, Samples
from observer.recordings.rest import rough

LATE = 0.001
"""A delay is taken off the stamps if it is more than this [s] and more than chance."""
LEAST_NOISE = (1e-4, 1e-4, 5e-5)
"""Noise of odometry before rounding is no smaller [m, m, rad] ..."""
PART = 0.05
"""... and no smaller than this part of a step of the rounding."""
SMOOTH = 0.05
"""Steps are taken together until their noise as a speed is below this [m/s] ..."""
LONGEST = 0.25
"""... but no longer than this [s]."""
LEAST_SPEED = (0.01, 0.01, 0.01)
"""Of wheel speeds [m/s, m/s, rad/s]."""
UNHEARD = 10.0
"""Factor on the yaw rate's noise where the gyro is to be believed and the wheels are not."""
LEAST_GYRO, LEAST_ACCEL = 1e-4, 5e-3
"""[rad/s], [m/s^2]"""
BLIND = 10.0
"""Noise of an accelerometer of which nobody knows which way it looks [m/s^2]."""
LEAST_DISTURBANCE = (0.05, 0.05, 0.1)
"""[m/s^2, m/s^2, rad/s^2]"""
BLOCK = 10.0
"""What the accelerometer reads in the mean over this long is bias or uneven ground [s]."""


def prepare(recording: Recording, diagnosis: Diagnosis) -> Recording:
    """Apply a diagnosis to the recording it was made of.

    Only what is to be estimated changes (``auto`` in a description; of a recording of another kind,
    the delays): IMU turned into B and its gyro bias taken off, stamps corrected, noise and the
    other figures of ``base`` filled in. The sensor of the wheels that is not to be used is None.

    Args:
        recording: as loaded.
        diagnosis: of it.

    Returns:
        The new recording; the same one if there is nothing of the wheels.
    """
    if not {"odometry", "speeds"} & set(diagnosis.timing):
        return recording
    auto = auto_of(recording)
    odometry, speeds, imu = recording.odometry, recording.speeds, recording.imu
    odometry = None if "odometry" in diagnosis.short else odometry
    early = Figure(0.0, 0.0)
    if odometry is not None and "odometry.delay" in auto:
        late = diagnosis.odometry_delay
        if late.value is not None and late.value < 0.0:
            early = Figure(-late.value, late.sigma)
            late = Figure(0.0, late.sigma)
        odometry = on_time(odometry, late, diagnosis.pose)
    if speeds is not None and "speeds.delay" in auto:
        speeds = on_time(speeds, diagnosis.speeds_delay, None)
    if odometry is not None and diagnosis.use == "speed":
        noise = max(diagnosis.wheels.noise[:2]) if diagnosis.wheels is not None else 0.0
        speeds = speeds_of(odometry, noise)
        odometry = None
    elif odometry is not None:
        speeds = None  # both come from the same wheels
    if imu is not None and diagnosis.inertial is not None:
        # nothing arrives before it is true: if odometry seems early, the IMU is stamped late
        imu = in_B(on_time(imu, early, None), diagnosis.inertial.mounting.R_BI)
        bias = diagnosis.gyro_bias.value
        if bias is not None and "imu.gyro_bias" in auto:
            imu.values[:, 2] -= bias
    wheels = odometry or speeds
    assert wheels is not None
    base = MobileBase(
        platform=_platform(recording, diagnosis, auto),
        odometry=_odometry(recording, diagnosis, auto, wheels),
        imu=_imu(recording, diagnosis, auto, imu),
    )
    return replace(recording, base=base, odometry=odometry, speeds=speeds, imu=imu)


def on_time(samples: Samples, delay: Figure, fit: TurnFit | None) -> Samples:
    """Samples with stamps corrected by a delay, where it is more than chance.

    Args:
        samples: as stamped.
        delay: of the stamps [s].
        fit: tells how it grows; None: it does not.
    """
    t, span = samples.t, float(samples.t[-1] - samples.t[0])
    if delay.value is not None and delay.beyond(0.0, LATE):
        t = t - delay.value
    drift = fit.drift if fit is not None else untold("")
    if fit is not None and drift.value is not None and drift.beyond(0.0, LATE / span, CREEPS):
        t = t - drift.value * (samples.t - fit.middle)
    return Samples(t, np.maximum(samples.arrival, t), samples.values)


def speeds_of(odometry: Samples, noise: float = 0.0) -> Samples:
    """Speeds V_OB_B between poses, stamped half-way; steps over a gap are left out.

    Args:
        odometry: poses.
        noise: of their position [m]; noisy steps are taken together, up to ``LONGEST``.
    """
    start, end, steps = steps_in_B(odometry)
    wanted = math.ceil(math.sqrt(2.0) * noise / SMOOTH / odometry.period)
    n = max(min(wanted, math.floor(LONGEST / odometry.period)), 1)
    whole = len(steps) // n * n
    start, end = start[:whole:n], end[n - 1 : whole : n]
    steps = steps[:whole].reshape(-1, n, 3).sum(axis=1)
    arrival = odometry.arrival[n : whole + 1 : n]
    keep = end - start < n * 3.0 * odometry.period
    length = (end - start)[keep, None]
    return Samples(0.5 * (start + end)[keep], arrival[keep], steps[keep] / length)


def _platform(recording: Recording, diagnosis: Diagnosis, auto: frozenset[str]) -> Platform:
    update: dict[str, object] = {}
    platform, wheels, drive = recording.base.platform, diagnosis.wheels, diagnosis.drive
    driven = drive is not None and drive.lag.value is not None
    if drive is not None and drive.lag.value is not None and "platform.lag" in auto:
        # the closed form of the motion model divides by the difference of the two times
        lag, other = drive.lag.value, platform.disturbance_time
        update["lag"] = lag if abs(lag - other) > 0.02 * other else 1.02 * other
        if "platform.command_delay" in auto:
            update["command_delay"] = drive.dead.otherwise(0.0)
    if "platform.disturbance" in auto and wheels is not None:
        spread, seen = wheels.acceleration, diagnosis.looking
        if seen is not None and math.isfinite(seen.moved):
            spread = (max(spread[0], seen.moved), max(spread[1], seen.moved), spread[2])
        if driven and drive is not None:
            spread = drive.disturbance
        pairs = zip(spread, LEAST_DISTURBANCE, strict=True)
        update["disturbance"] = tuple(max(a, least) for a, least in pairs)
    return platform.model_copy(update=update)


def _odometry(
    recording: Recording, diagnosis: Diagnosis, auto: frozenset[str], wheels: Samples
) -> Odometry:
    update: dict[str, object] = {"delay": max(float(np.median(wheels.arrival - wheels.t)), 0.0)}
    own, found, fit = recording.base.odometry, diagnosis.wheels, diagnosis.pose
    if "odometry.resolution" in auto and found is not None:
        pairs = zip(found.resolution, own.resolution, strict=True)
        update["resolution"] = tuple(old if new is None else new for new, old in pairs)
    if "odometry.noise" in auto and found is not None:
        resolution = update.get("resolution", own.resolution)
        assert isinstance(resolution, tuple)
        three = zip(found.noise, resolution, LEAST_NOISE, strict=True)
        update["noise"] = tuple(max(n, PART * q, least) for n, q, least in three)
    if "odometry.scale" in auto:
        distance, turn = diagnosis.distance, fit.scale if fit is not None else None
        update["scale"] = (_unless_one(distance), _unless_one(turn))
    if "speeds.noise" in auto or (diagnosis.use == "speed" and diagnosis.wheels is not None):
        update["speed_noise"] = _speed_noise(diagnosis, wheels)
    update["rate"] = 1.0 / wheels.period
    return own.model_copy(update=update)


def _unless_one(scale: Figure | None) -> float:
    if scale is None or scale.value is None or not scale.beyond(1.0, 0.003):
        return 1.0
    return scale.value


def _speed_noise(diagnosis: Diagnosis, wheels: Samples) -> tuple[float, float, float]:
    """Of speeds that were made of poses, or that came as such."""
    fit = diagnosis.pose or diagnosis.speeds
    along, across, turn = (rough(wheels.t, column) for column in wheels.values.T)
    if fit is not None and math.isfinite(fit.residual):
        turn = max(turn, fit.residual)
    if diagnosis.wheels is not None:
        turn *= UNHEARD
    x, y, w = LEAST_SPEED
    return max(along, x), max(across, y), max(turn, w)


def _imu(
    recording: Recording, diagnosis: Diagnosis, auto: frozenset[str], imu: Samples | None
) -> Imu:
    found = diagnosis.inertial
    if found is None or imu is None:
        return recording.base.imu
    update: dict[str, object] = {"rotation": (0.0, 0.0, 0.0)}
    if "imu.gyro_noise" in auto:
        update["gyro_noise"] = max(found.gyro_noise.otherwise(0.0), found.gyro_rough, LEAST_GYRO)
    if "imu.accel_noise" in auto:
        noise = max(found.accel_noise.otherwise(0.0), found.accel_rough, LEAST_ACCEL)
        update["accel_noise"] = noise
    if not found.mounting.forward:
        update["accel_noise"] = BLIND
    if "imu.gyro_bias" in auto:
        bias = diagnosis.gyro_bias
        told = bias.value is not None and math.isfinite(bias.sigma)
        update["gyro_bias"] = max(2.0 * bias.sigma, 3e-4) if told else 0.01
    if "imu.accel_bias" in auto:
        blocks = np.floor((imu.t - imu.t[0]) / BLOCK).astype(np.int64)
        count = np.maximum(np.bincount(blocks), 1)
        means = [np.bincount(blocks, imu.values[:, k]) / count for k in (3, 4)]
        size = math.sqrt(float(np.mean(np.square(means))))
        update["accel_bias"] = max(size, 0.02)
    return recording.base.imu.model_copy(update=update)
