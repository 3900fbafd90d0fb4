"""What a recording tells of the robot that it came from: timing, noise, mounting, delays, scale."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from observer.recordings.average import fit_average
from observer.recordings.bias import steps_at_rest, steps_in_motion
from observer.recordings.delay import CREEPS, TurnFit, fit_turns, without_drift
from observer.recordings.drive import accelerations, fit_drive, steps_in_B
from observer.recordings.facts import Diagnosis, Wheels
from observer.recordings.frames import in_B
from observer.recordings.increments import Noise, Turns, of_pose, of_rate
from observer.recordings.inertial import inertial, mounting_of
from observer.recordings.looking import look
from observer.recordings.paths import distance_scale, error, gyro_heading, rebuilt
from observer.recordings.recording import Recording, Samples
from observer.recordings.resolution import resolution
from observer.recordings.rest import rough, stands
from observer.recordings.rounding import refine
from observer.recordings.series import Integral, Polyline
from observer.recordings.timing import leaps, repeated_in_motion, timing
from observer.recordings.trust import trusted

__all__ = ["Diagnosis", "Wheels", "diagnose"]

FEWEST = 10
"""Samples below which a sensor tells nothing."""
LONG = 5.0
"""A step of odometry over this many periods says nothing of the motion within."""
HOLE = 0.15
"""A gap of the gyro from which its integral is not to be trusted [s]."""
ROUNDED = 2.0
"""Noise on the heading below this many variances of its rounding: rounding rules."""
LARGE = 20000
"""Samples from which least squares is good enough."""


def diagnose(recording: Recording) -> Diagnosis:
    """Look at a recording; nothing of it is changed.

    Args:
        recording: with odometry or speeds.
    """
    r = recording
    named = {"odometry": r.odometry, "speeds": r.speeds, "imu": r.imu}
    named |= {"commands": r.commands, "reference": r.reference}
    present = {name: s for name, s in named.items() if s is not None}
    sensors = {name: s for name, s in present.items() if len(s) >= FEWEST}
    found = Diagnosis(
        name=r.name,
        timing={name: timing(s) for name, s in sensors.items()},
        short=tuple(name for name in present if name not in sensors),
    )
    if "odometry" not in sensors and "speeds" not in sensors:
        return replace(found, because="there is nothing of the wheels")
    if "odometry" in sensors:
        found = replace(found, wheels=_wheels(sensors["odometry"]))
    if "imu" in sensors:
        found = _with_imu(found, recording, sensors)
    odometry = sensors.get("odometry")
    delay = found.odometry_delay.otherwise(0.0)
    if odometry is not None and "commands" in sensors:
        time = recording.base.platform.disturbance_time
        steps = _steps(found)
        drive = fit_drive(sensors["commands"], odometry, delay, steps, time)
        found = replace(found, drive=drive)
    if odometry is not None and "reference" in sensors:
        reference, sigma = sensors["reference"], recording.reference_sigma
        shifted = Samples(odometry.t - delay, odometry.arrival, odometry.values)
        found = replace(found, distance=distance_scale(shifted, reference, sigma))
        found = replace(found, paths=_paths(found, shifted, sensors))
    use, because = trusted(found)
    return replace(found, use=use, because=because)


def _with_imu(found: Diagnosis, recording: Recording, sensors: dict[str, Samples]) -> Diagnosis:
    """Everything that takes the IMU."""
    imu, odometry, speeds = sensors["imu"], sensors.get("odometry"), sensors.get("speeds")
    mounting = mounting_of(recording, imu)
    level = in_B(imu, mounting.R_BI)
    gyro = Integral(level.t, level.values[:, 2])
    pauses = list(found.timing["imu"].gaps)
    holes = [gap for gap in pauses if gap[1] - gap[0] > HOLE]
    walk = rough(level.t, level.values[:, 2]) ** 2 * imu.period
    turns: Turns | None = None
    if odometry is not None:
        pauses += found.timing["odometry"].gaps
        turns = of_pose(odometry.t, odometry.values[:, 2])
        turns = turns.keep(np.asarray(turns.end - turns.start < LONG * odometry.period))
        fit = _by_gyro(turns, odometry, gyro, holes, walk, _steps(found)[2])
        where = (recording.base.imu.position[0], recording.base.imu.position[1])
        looking = look(odometry, level, where, pauses, fit.delay.value)
        mounting = mounting.looked(looking)
        found = replace(found, pose=fit, looking=looking)
    if speeds is not None:
        found = _with_speeds(found, speeds, odometry, gyro, holes, walk)
        if turns is None:
            h = speeds.period
            turns = of_rate(speeds.t, speeds.values[:, 2], h, -0.5 * h)
    wheels = odometry if odometry is not None else speeds
    assert wheels is not None
    delay = (found.odometry_delay if odometry is not None else found.speeds_delay).otherwise(0.0)
    x, y, heading = _steps(found)
    in_base = in_B(imu, mounting.R_BI)
    rests = stands(wheels, odometry is not None, (max(x, y), heading), in_base, delay)
    found = replace(found, inertial=inertial(in_base, mounting, rests))
    against = found.pose or found.speeds
    moved = steps_at_rest(rests)
    if len(rests) < 2 and turns is not None and against is not None and against.delay.told:
        noise, inflation = against.noise, _inflation(against, turns)
        moved = steps_in_motion(turns, gyro, delay, noise, inflation)
    return replace(found, bias_steps=tuple(moved))


def _with_speeds(
    found: Diagnosis,
    speeds: Samples,
    odometry: Samples | None,
    gyro: Integral,
    holes: list[tuple[float, float]],
    walk: float,
) -> Diagnosis:
    """Yaw rate of the speeds against gyro and pose."""
    rate, h = speeds.values[:, 2], speeds.period
    fit = fit_turns(of_rate(speeds.t, rate, h, -0.5 * h), gyro, holes, Noise(0.0, walk))
    by_gyro = fit_average(speeds.t, rate, gyro, holes)
    found = replace(found, speeds=fit, average_by_gyro=by_gyro)
    if odometry is None:
        return found
    heading = Polyline(odometry.t, odometry.values[:, 2])
    pauses = list(found.timing["odometry"].gaps)
    return replace(found, average_by_pose=fit_average(speeds.t, rate, heading, pauses))


def _by_gyro(
    turns: Turns,
    odometry: Samples,
    gyro: Integral,
    holes: list[tuple[float, float]],
    walk: float,
    step: float,
) -> TurnFit:
    """Heading of odometry against the gyro; with the intervals where rounding rules the noise."""
    rounding = step**2 / 12.0
    fit = fit_turns(turns, gyro, holes, Noise(rounding, walk))
    rules = step > 0.0 and fit.noise.white < ROUNDED * rounding
    if not (rules and fit.delay.value is not None and fit.scale.value is not None):
        return fit
    if holes or len(odometry) > LARGE:
        return fit
    stamps = odometry.t
    if fit.drift.value is not None and fit.drift.beyond(0.0, 0.0, CREEPS):
        stamps = without_drift(stamps, fit.drift.value, fit.middle)
    delay = refine(
        stamps,
        odometry.values[:, 2],
        step,
        gyro,
        fit.delay.value,
        fit.delay.sigma,
        fit.scale.value,
        walk,
    )
    return replace(fit, delay=delay) if delay.sigma < fit.delay.sigma else fit


def _wheels(odometry: Samples) -> Wheels:
    steps = [resolution(column) for column in odometry.values.T]
    noise = [
        math.sqrt(max(rough(odometry.t, column) ** 2 - (step or 0.0) ** 2 / 12.0, 0.0))
        for column, step in zip(odometry.values.T, steps, strict=True)
    ]
    variance = np.square(noise) + np.square([step or 0.0 for step in steps]) / 12.0
    x, y, heading = accelerations(*steps_in_B(odometry), variance)
    return Wheels(
        resolution=(steps[0], steps[1], steps[2]),
        noise=(noise[0], noise[1], noise[2]),
        acceleration=(x, y, heading),
        leaps=tuple(leaps(odometry)),
        repeated=repeated_in_motion(odometry),
    )


def _steps(found: Diagnosis) -> tuple[float, float, float]:
    if found.wheels is None:
        return 0.0, 0.0, 0.0
    x, y, heading = found.wheels.resolution
    return x or 0.0, y or 0.0, heading or 0.0


def _inflation(fit: TurnFit, turns: Turns) -> float:
    """By how much the figures scatter more over the log than their noise says."""
    if fit.scale.value is None or not fit.scale.sigma > 0.0:
        return 1.0
    length = float(np.mean(turns.end - turns.start))
    power = 2.0 * fit.noise.white + fit.noise.walk * length
    own = math.sqrt(power / len(turns)) / max(fit.turned * length, 1e-12)
    return min(max(fit.scale.sigma / own, 1.0), 10.0)


def _paths(
    found: Diagnosis, odometry: Samples, sensors: dict[str, Samples]
) -> dict[str, float] | None:
    """Distance from the reference of what odometry, on the IMU's clock, could have walked."""
    reference = sensors["reference"]
    out = {"pose": error(odometry, odometry.values[:, :2], reference)}
    if found.pose is None or found.inertial is None or found.pose.scale.value is None:
        return out
    heading = odometry.values[:, 2]
    scaled = heading[0] + (heading - heading[0]) / found.pose.scale.value
    out["scaled pose"] = error(odometry, rebuilt(odometry, scaled), reference)
    level = in_B(sensors["imu"], found.inertial.mounting.R_BI)
    gyro = Integral(level.t, level.values[:, 2])
    bias = found.gyro_bias.otherwise(0.0)
    turned = gyro_heading(odometry, gyro, 0.0, bias)
    out["gyro heading"] = error(odometry, rebuilt(odometry, turned), reference)
    return out
