"""The board's drift in odometry is found by vision, however late, and given out without steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deploy.task import BoardPose
from observer.board_frame import BoardFrame
from services.messages import Array, BoardEstimate, Estimate, Vision

BOARD = BoardPose(x=0.68, y=0.0)
PERIOD, LATE = 0.01, 0.025
SPEED = 0.12


def estimate_at(t: float, pose: Array, velocity: Array) -> Estimate:
    """What the observer says of a platform whose odometry it believes."""
    zero = np.zeros(3)
    return Estimate(
        t=t,
        pose=pose,
        velocity=velocity,
        acceleration=zero,
        covariance=np.eye(6),
        gyro_bias=0.0,
        accel_bias=np.zeros(2),
        odometry_innovation=zero,
        odometry_nis=0.0,
        imu_innovation=zero,
        imu_nis=0.0,
        odometry_age=0.0,
        imu_age=0.0,
        command_age=0.0,
    )


def drive(
    scale: float = 1.0,
    slip: float = 0.0,
    seen: tuple[float, float] = (0.0, 100.0),
    outlier: float = 0.0,
    noise: float = 0.0015,
    seed: int = 1,
) -> tuple[BoardFrame, list[BoardEstimate], Array]:
    """20 s along the board; what is given out, and the true drift along it then [m], (n,).

    Args:
        scale: odometry over truth.
        slip: not seen by the wheels, between 8 and 9 s [m].
        seen: from when to when there are sightings [s].
        outlier: of every tenth sighting [m].
        noise: of a sighting [m].
        seed: of the noise.
    """
    rng = np.random.default_rng(seed)
    frame = BoardFrame((BOARD.x, BOARD.y, BOARD.yaw))
    waiting: list[tuple[float, Vision]] = []
    given, drift = [], []
    R_BS = BOARD.rotation()
    for n in range(2000):
        t = n * PERIOD
        true = 1.2 - SPEED * t - slip * min(max(t - 8.0, 0.0), 1.0)
        read = 1.2 - scale * SPEED * t
        pose, velocity = np.array([0.0, read, 0.0]), np.array([0.0, -scale * SPEED, 0.0])
        if n % 3 == 0 and seen[0] <= t < seen[1]:
            p = BOARD.position() - [0.0, true, 0.0] + noise * rng.standard_normal(3)
            p[1] += outlier if n % 30 == 0 else 0.0
            covariance = np.diag([noise**2] * 3 + [1e-3**2] * 3)
            waiting.append((t + LATE, Vision(t, p, R_BS, covariance, "board")))
        arrived = [v for at, v in waiting if at <= t]
        waiting = [(at, v) for at, v in waiting if at > t]
        out = frame.step(estimate_at(t, pose, velocity), arrived)
        if out is not None:
            given.append(out)
            drift.append(read - true)
    return frame, given, np.array(drift)


def errors(given: list[BoardEstimate], drift: Array) -> Array:
    """Along the board [m], (n,)."""
    return np.array([g.pose[1] for g in given]) - drift


def test_the_drift_of_a_wrong_wheel_scale_is_followed() -> None:
    """0.5 % over 2.4 m are 12 mm; half a millimetre of them is left, and the scale is known."""
    _, given, drift = drive(scale=1.005)
    assert abs(drift[-1]) > 0.011
    assert np.abs(errors(given, drift)[250:]).max() < 6e-4
    assert given[-1].wheel_scale == pytest.approx(1.005, abs=5e-4)


def test_with_true_wheels_the_board_stays_where_it_is() -> None:
    """To 0.4 mm, by sightings each of which is 1.5 mm wrong."""
    _, given, drift = drive()
    assert np.abs(errors(given, drift)).max() < 6e-4
    assert float(np.sqrt(np.mean(errors(given, drift) ** 2))) < 3e-4


def test_while_the_board_is_hidden_the_scale_carries_on() -> None:
    """From 10 s on nothing is seen; 6 mm of drift later the error is a small part of that."""
    _, given, drift = drive(scale=1.005, seen=(0.0, 10.0))
    assert abs(errors(given, drift)[-1]) < 1.2e-3
    assert given[-1].age > 9.0


def test_nothing_is_given_out_in_steps() -> None:
    """Pose and velocity fit, a slip of 4 mm included, and the correction is bounded."""
    _, given, _ = drive(scale=1.005, slip=0.004)
    pose = np.array([g.pose for g in given])
    velocity = np.array([g.velocity for g in given])
    assert pose[1:] == pytest.approx(pose[:-1] + 0.02 * velocity[:-1], abs=1e-9)
    assert np.abs(velocity[:, :2]).max() < 0.004 + 0.01 * SPEED
    assert np.abs(np.diff(velocity[:, :2], axis=0)).max() < 5e-4


def test_a_slip_is_noticed() -> None:
    """3 s after it ended less than 1 mm of 4 mm is left."""
    _, given, drift = drive(slip=0.004)
    late = np.array([g.t for g in given]) > 12.0
    assert np.abs(errors(given, drift)[late]).max() < 1e-3


def test_outliers_are_refused() -> None:
    """One in ten is 50 mm wrong and counts for nothing."""
    frame, given, drift = drive(outlier=0.05)
    assert frame.refused >= 60
    assert np.abs(errors(given, drift)).max() < 8e-4


def test_nothing_is_said_before_the_board_was_seen() -> None:
    """So that an arm without a camera works as ever."""
    assert drive(seen=(100.0, 101.0))[1] == []


def test_other_objects_and_sightings_of_long_ago_are_left_out() -> None:
    """Only the board, and only what the platform's pose is still known for."""
    frame = BoardFrame((0.68, 0.0, 0.0))
    frame.step(estimate_at(5.0, np.zeros(3), np.zeros(3)), [])
    R, eye = BOARD.rotation(), np.eye(6) * 1e-6
    cup = Vision(5.0, np.ones(3), R, eye, "cup")
    old = Vision(3.0, BOARD.position(), R, eye, "board")
    assert frame.step(estimate_at(5.01, np.zeros(3), np.zeros(3)), [cup, old]) is None
    assert (frame.taken, frame.refused) == (0, 1)
    assert math.isclose(frame.x[0], 0.68)
