"""How late the stamps of wheels are: told to a millisecond or two, or said that it cannot be."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from observer.bench.manoeuvres import sway
from observer.bench.world import simulate
from observer.recordings.delay import fit_turns
from observer.recordings.diagnosis import diagnose
from observer.recordings.increments import Noise, bottom, of_pose
from observer.recordings.series import Integral
from tests.observer.recordings_help import recorded
from tests.observer.recordings_motion import course, logged

SHIFTS = (0.0, 0.02, 0.18, 0.38)


@pytest.mark.parametrize("rate", [20.0, 10.0, 5.0])
def test_twenty_seconds_of_our_robot_tell_the_delay_to_2_ms(rate: float) -> None:
    """Gentle sway, 1 mm / 0.1 deg, gyro of 0.05 deg/s: every one of ten runs, any delay."""
    errors = []
    for seed in range(10):
        shift = SHIFTS[seed % 4]
        r = recorded(simulate(sway, seed, 21.0, odometry_rate=rate, stamp_error=shift))
        found = diagnose(replace(r, commands=None, reference=None))
        assert found.pose is not None and found.pose.delay.value is not None
        errors.append(1e3 * (found.pose.delay.value - shift))
    rms = float(np.sqrt(np.mean(np.square(errors))))
    print(f"{rate:.0f} Hz: rms {rms:.2f}, worst {np.max(np.abs(errors)):.2f} ms")
    assert np.max(np.abs(errors)) < 2.0


@pytest.mark.parametrize("rate", [5.0, 100.0])
@pytest.mark.parametrize("imu", [30.0, 400.0])
def test_any_rate_will_do(rate: float, imu: float) -> None:
    """Odometry at 5 to 100 Hz, IMU at 30 or 400 Hz, a robot that turns well: 0.5 ms."""
    true = course(1, 30.0)
    found = diagnose(logged(true, 1, odometry_rate=rate, imu_rate=imu, delay=0.15))
    assert found.odometry_delay.otherwise(9.0) == pytest.approx(0.15, abs=5e-4)
    assert found.pose is not None
    assert found.pose.scale.otherwise(9.0) == pytest.approx(1.0, abs=0.002)


@pytest.mark.parametrize("delay", [-0.3, -0.1, 0.0, 0.4])
def test_pose_may_lead(delay: float) -> None:
    """Both signs; and a heading that winds up over many turns and was wrapped."""
    true = course(4, 30.0, yaw=0.5, turning=1.0)
    assert np.ptp(true.pose[:, 2]) > 2 * math.pi
    found = diagnose(logged(true, 2, delay=delay))
    assert found.odometry_delay.otherwise(9.0) == pytest.approx(delay, abs=5e-4)


def test_jitter_and_scale_do_no_harm() -> None:
    """Sampled 10 ms unevenly, heading ten per cent short: delay and scale come out."""
    true = course(2, 40.0)
    found = diagnose(logged(true, 2, delay=0.05, jitter=0.01, scale=0.9))
    assert found.odometry_delay.otherwise(9.0) == pytest.approx(0.05, abs=1e-3)
    assert found.pose is not None and found.pose.scale.otherwise(9.0) == pytest.approx(
        0.9, abs=3e-3
    )


def test_two_clocks_are_told_from_one() -> None:
    """A delay that grows by 200 parts in a million is found to a tenth, and none where none is."""
    true = course(3, 45.0)
    fit = diagnose(logged(true, 2, drift=2e-4, delay=0.05)).pose
    assert fit is not None and fit.drift.otherwise(9.0) == pytest.approx(2e-4, abs=3e-5)
    assert fit.delay.otherwise(9.0) == pytest.approx(0.05, abs=1e-3)
    fit = diagnose(logged(true, 2, delay=0.05)).pose
    assert fit is not None and not fit.drift.beyond(0.0, 0.0, 5.0)


@pytest.mark.parametrize("speed", [0.0, 0.3])
def test_without_yaw_the_accelerometer_tells(speed: float) -> None:
    """Sideways or ahead with next to no turning: to 15 ms, and the gyro is silent."""
    true = course(5, 60.0, yaw=0.001, speed=speed, sideways=0.2 if speed == 0.0 else 0.0)
    found = diagnose(logged(true, 2, delay=0.1))
    assert found.pose is not None and not found.pose.delay.told
    assert found.odometry_delay.otherwise(9.0) == pytest.approx(0.1, abs=0.015)


@pytest.mark.parametrize("speed", [0.0, 1e-3])
def test_too_little_motion_is_said(speed: float) -> None:
    """A robot that stands, or creeps a millimetre a second, tells no delay: none is made up."""
    found = diagnose(logged(course(6, 40.0, yaw=speed / 2, speed=speed), 2, delay=0.1))
    assert not found.odometry_delay.told
    assert "too little motion" in found.odometry_delay.reason
    assert found.pose is not None and not found.pose.scale.told


def test_gaps_of_the_gyro_are_left_out() -> None:
    """A gyro that is away for two seconds, thrice, does not spoil the delay."""
    r = logged(course(7, 40.0), 3, delay=0.12)
    assert r.imu is not None and r.odometry is not None
    keep = np.ones(len(r.imu), dtype=bool)
    for start in (8.0, 17.0, 29.0):
        keep &= ~((r.imu.t > start) & (r.imu.t < start + 2.0))
    gyro = Integral(r.imu.t[keep], r.imu.values[keep, 2])
    holes = [(a, b) for a, b in pairwise(r.imu.t[keep].tolist()) if b - a > 0.1]
    fit = fit_turns(
        of_pose(r.odometry.t, r.odometry.values[:, 2]), gyro, holes, Noise(2.5e-7, 8e-9)
    )
    assert fit.delay.otherwise(9.0) == pytest.approx(0.12, abs=1e-3)


def test_stated_deviations_are_honest() -> None:
    """Over 8 random courses the error is one stated deviation, within a factor of two."""
    ratio = []
    for seed in range(8):
        delay = diagnose(logged(course(seed, 12.0, yaw=0.1), seed, delay=0.1)).odometry_delay
        if delay.value is not None:
            ratio.append((delay.value - 0.1) / delay.sigma)
    assert len(ratio) >= 7
    assert 0.5 < np.sqrt(np.mean(np.square(ratio))) < 2.0


def test_bottom_of_a_parabola() -> None:
    """Exact, wherever the points lie about it."""
    x = np.linspace(0.9, 1.5, 7)
    assert bottom(x, 3.0 * (x - 1.1) ** 2 + 2.0) == pytest.approx((1.1, 6.0))
