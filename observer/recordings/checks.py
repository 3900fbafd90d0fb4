"""Holds the sensors of a log against each other and against gravity: wrong units, wrong axes."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from observer.recordings.description import ImuColumns, LogDescription
from observer.recordings.frames import GRAVITY, axis_vector, nearest_axis
from observer.recordings.log import Log
from observer.recordings.problems import Problems
from observer.recordings.recording import Recording, Samples
from observer.recordings.series import Integral
from services.messages import Array

HEAVY = (0.92, 1.08)
"""Of standard gravity, what an accelerometer in m/s^2 may read."""
LIGHT = 0.2
"""Below this share of gravity it has been taken out."""
WINDOW = 0.5
"""Turns are compared over this long [s] ..."""
SHIFTS = np.arange(-0.5, 1.0, 0.05)
"""... with one of the two late by this [s]."""
ENOUGH = 0.05
"""Turn over a window that is motion, root mean square [rad]."""
ALIKE = 0.6
"""Correlation from which two turns are the same turn."""
FACTOR = (1.0 / 3.0, 3.0)
"""What odometry may read over the gyro."""
DEGREES = (30.0, 110.0)
"""A factor in between is 57.3, or its inverse: degrees for radians."""


def check_together(log: Log, description: LogDescription, problems: Problems) -> None:
    """Report what the sensors of a log say of each other."""
    _same_time(log, problems)
    if problems.errors:
        return
    for name, values in (("odometry", log.odometry), ("speeds", log.speeds)):
        if values is not None and name == "odometry":
            _heading_in_radians(values, problems)
    if log.odometry is not None and log.speeds is not None:
        _same_length(log.odometry, log.speeds, problems)
    if log.imu is not None and description.imu is not None:
        up = _gravity(log.imu, description.imu, problems)
        if up is not None:
            _same_turn(log, up, problems)


def _same_time(log: Recording, problems: Problems) -> None:
    named = {"odometry": log.odometry, "speeds": log.speeds, "imu": log.imu}
    named |= {"commands": log.commands, "reference": log.reference}
    spans = {k: (float(s.t[0]), float(s.t[-1])) for k, s in named.items() if s is not None}
    for (a, (start, end)), (b, (first, last)) in combinations(spans.items(), 2):
        if min(end, last) <= max(start, first):
            problems.error(
                f"{a} and {b} do not overlap in time ({start:.6g} to {end:.6g} s and"
                f" {first:.6g} to {last:.6g} s after the first sample of all): different clocks"
                " or units; name the column of arrival as time, or give time_unit"
            )


def _heading_in_radians(odometry: Samples, problems: Problems) -> None:
    rate = np.abs(np.diff(odometry.values[:, 2])) / np.diff(odometry.t)
    if len(rate) and float(np.percentile(rate, 95)) > 15.0:
        problems.error(
            'odometry: heading turns at more than 15 rad/s: is it in degrees? angle_unit = "deg"'
        )


def _same_length(odometry: Samples, speeds: Samples, problems: Problems) -> None:
    """Distance by pose and by speed must not differ by the factor of a unit."""
    start, end = max(odometry.t[0], speeds.t[0]), min(odometry.t[-1], speeds.t[-1])
    pose, speed = odometry.between(start, end), speeds.between(start, end)
    if len(pose) < 2 or len(speed) < 2:
        return
    walked = float(np.sum(np.hypot(*np.diff(pose.values[:, :2], axis=0).T)))
    rolled = float(np.trapezoid(np.hypot(*speed.values[:, :2].T), speed.t))
    if min(walked, rolled) > 1e-3 and not 0.05 < walked / rolled < 20.0:
        problems.error(
            f"odometry goes {walked:.4g} m, speeds add up to {rolled:.4g} m: check length_unit"
        )


def _gravity(imu: Samples, table: ImuColumns, problems: Problems) -> Array | None:
    """The direction up (3) in the sensor's axes; None where that cannot be told."""
    f = np.median(imu.values[:, 3:], axis=0)
    size = float(np.linalg.norm(f))
    share = size / GRAVITY
    in_g = HEAVY[0] <= size <= HEAVY[1]
    if share < LIGHT and not in_g:
        if table.up is None and table.rotation is None:
            problems.error(
                f"imu: accelerometer reads {size:.3g} m/s^2 at most times: gravity has been taken"
                ' out, so say how it is mounted: up = "+z" or the like'
            )
            return None
        problems.warning("no-gravity", "imu: gravity has been taken out of the accelerometer")
        return axis_vector(table.up) if table.up else None
    if not HEAVY[0] <= share <= HEAVY[1]:
        read = f"imu: accelerometer reads {size:.4g} m/s^2 at most times, not 9.81: "
        if in_g:
            problems.error(read + 'is it in g? accel_unit = "g"')
        elif HEAVY[0] <= size / 1000.0 <= HEAVY[1]:
            problems.error(read + 'is it in mg? accel_unit = "mg"')
        elif HEAVY[0] <= share / GRAVITY <= HEAVY[1]:
            problems.error(read + 'is it in m/s^2? accel_unit = "m/s^2"')
        else:
            problems.error(read + "wrong columns or unit")
        return None
    axis, _ = nearest_axis(f)
    if table.up is not None and axis != table.up:
        angle = math.degrees(math.acos(np.clip(axis_vector(table.up) @ f / size, -1.0, 1.0)))
        problems.error(
            f"imu: gravity is on {axis}, {angle:.0f} deg from up = {table.up!r}:"
            f' up = "{axis}" or "auto", or the columns are in another order'
        )
        return None
    return f / size


def _same_turn(log: Log, up: Array, problems: Problems) -> None:
    """Gyro and wheels must see the same turns, in size and sign."""
    assert log.imu is not None
    gyro = Integral(log.imu.t, log.imu.values[:, :3] @ up)
    for name, wheels in (("odometry", log.odometry), ("speeds", log.speeds)):
        if wheels is None:
            continue
        turned = wheels.values[:, 2]
        if name == "odometry":
            heading = Integral(wheels.t, np.gradient(turned, wheels.t))
        else:
            heading = Integral(wheels.t, turned)
        slope = _slope(gyro, heading, log.imu.values[:, :3])
        if slope is None or FACTOR[0] <= slope <= FACTOR[1]:
            continue
        size = abs(slope)
        if DEGREES[0] < 1.0 / size < DEGREES[1]:
            why = 'is the gyro in degrees? [imu] angle_unit = "deg"'
        elif DEGREES[0] < size < DEGREES[1]:
            why = f'is {name} in degrees? [{name}] angle_unit = "deg"'
        elif slope < 0 and FACTOR[0] <= size <= FACTOR[1]:
            why = "one of them counts clockwise: put a minus before the name of its column"
        else:
            why = "wrong columns, axes or unit"
        problems.error(f"{name} turns {slope:.3g} times as far as the gyro: {why}")


def _slope(gyro: Integral, heading: Integral, rates: Array) -> float | None:
    """Turn by wheels over turn by gyro; None where there is too little of it to say."""
    start = max(gyro.start, heading.start) - SHIFTS[0]
    end = min(gyro.end, heading.end) - SHIFTS[-1] - WINDOW
    t = np.arange(start, end, WINDOW)
    if len(t) < 8:
        return None
    a = gyro(t + WINDOW) - gyro(t)
    a = a - np.mean(a)
    best, slope = 0.0, 0.0
    for shift in SHIFTS:
        b = heading(t + shift + WINDOW) - heading(t + shift)
        b = b - np.mean(b)
        product, power, other = float(a @ b), float(a @ a), float(b @ b)
        if min(power, other) <= 0.0:
            return None
        alike = product / math.sqrt(power * other)
        if abs(alike) > abs(best):
            # errors in both: the ratio of the two sizes, with the sign of the product
            best, slope = alike, math.copysign(math.sqrt(other / power), product)
    # in whatever unit the gyro is, one of the two must have moved
    moved = max(math.sqrt(float(np.mean(a * a))), math.sqrt(float(np.mean(b * b))))
    return slope if abs(best) > ALIKE and moved > ENOUGH else None
