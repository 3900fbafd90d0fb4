"""The platform's drive and what disturbs it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.sim.sim_loop import Recording, drive, scenario

MASS = 186.6  # platform, arm and tool [kg]


def ahead(_: float) -> tuple[float, float, float]:
    """Drive at 0.3 m/s."""
    return 0.3, 0.0, 0.0


def still(_: float) -> tuple[float, float, float]:
    """Stay."""
    return 0.0, 0.0, 0.0


def last_command(recording: Recording, t: float) -> float:
    """Largest speed from ``t`` [s] on [m/s]."""
    return float(np.abs(recording.velocity[round(1000 * t) :]).max())


@pytest.mark.parametrize(
    ("axis", "command"), [(0, (0.1, 0, 0)), (1, (0, -0.1, 0)), (2, (0, 0, 0.2))]
)
def test_drive_follows_with_its_time_constant(
    axis: int, command: tuple[float, float, float]
) -> None:
    """A small step is followed as a first-order lag of 0.15 s, within 5 %."""
    v = np.abs(drive(scenario(), 1.5, lambda _: command).velocity[:, axis])
    end = abs(command[axis])
    assert v[-1] == pytest.approx(end, rel=0.005)
    # by the area above the response, which no single sample decides
    assert np.sum(end - v) * 0.001 / end == pytest.approx(0.15, rel=0.05)
    assert v[150] == pytest.approx(end * (1 - np.exp(-1)), rel=0.05)


def test_drive_keeps_its_speed_and_acceleration_limits() -> None:
    """Asked for 5 m/s it goes to 1.2 m/s at 1.5 m/s^2."""
    run = drive(scenario(), 1.6, lambda _: (5.0, 0.0, 0.0))
    v = run.velocity[:, 0]
    assert v.max() == pytest.approx(1.2, rel=0.01)
    smooth = (v[20:] - v[:-20]) / 0.02
    assert smooth.max() == pytest.approx(1.5, rel=0.05)


def test_silent_base_stops_the_platform_within_300_ms() -> None:
    """From 0.3 m/s the platform is at rest 0.3 s after the last command, and stays there."""
    run = drive(scenario(), 2.0, lambda t: ahead(t) if t <= 1.0 else None)
    assert run.velocity[1000, 0] > 0.29
    assert last_command(run, 1.3) < 0.005
    braking = (run.velocity[1020:, 0] - run.velocity[1000:-20, 0]) / 0.02
    assert braking.min() > -1.6
    assert np.ptp(run.pose[1400:], axis=0).max() < 1e-15


def test_fast_platform_brakes_at_its_limit_when_the_base_is_silent() -> None:
    """From 1.2 m/s the limit of 1.5 m/s^2 takes 0.8 s after the watchdog's 0.1 s."""
    run = drive(scenario(), 3.0, lambda t: (1.2, 0.0, 0.0) if t <= 1.5 else None)
    assert last_command(run, 1.5 + 0.1 + 0.8 + 0.02) < 0.01
    assert run.velocity[1500 + 700, 0] > 0.1


def test_one_lost_command_is_not_silence() -> None:
    """Commands come every 50 ms; without one of them the platform hardly slows down."""
    run = drive(scenario(), 1.5, lambda t: None if abs(t - 1.0) < 0.01 else ahead(t))
    assert run.velocity[950:, 0].min() > 0.29


def test_standing_platform_is_exactly_still() -> None:
    """With the drive asked to stay, the pose stands still to 1e-15 m."""
    run = drive(scenario(exact=False), 1.0, still)
    assert np.ptp(run.pose[100:], axis=0).max() < 1e-15


def test_wheels_hold_against_a_light_push_and_give_way_to_a_strong_one() -> None:
    """30 N do not move a standing platform, 300 N do."""
    light, strong = (
        drive(
            scenario({"kind": "push", "t": 0.2, "duration": 0.2, "force": force}), 0.5, still
        ).pose[-1, 0]
        for force in (30.0, 300.0)
    )
    assert light == pytest.approx(0.0, abs=1e-6)
    assert strong > 0.005


@pytest.mark.parametrize("direction", [0.0, 90.0, 210.0])
def test_push_gives_its_impulse(direction: float) -> None:
    """A short push changes the velocity by impulse over mass, within 20 %, along its direction."""
    push = {"kind": "push", "t": 0.5, "duration": 0.02, "force": 900.0, "direction": direction}
    run = drive(scenario(push), 0.6, still)
    change = run.velocity[520, :2]
    along = np.array([np.cos(np.radians(direction)), np.sin(np.radians(direction))])
    assert change @ along == pytest.approx(900.0 * 0.02 / MASS, rel=0.2)
    assert abs(change @ np.array([-along[1], along[0]])) < 0.01


def test_push_on_a_link_acts_on_that_link() -> None:
    """A push on link 3 of an arm without torque turns joint 1."""
    push = {
        "kind": "push",
        "t": 0.1,
        "duration": 0.1,
        "force": 200.0,
        "direction": 90,
        "on": "link3",
    }
    limp = drive(scenario(push), 0.25, still, torque=lambda _: np.zeros(6))
    calm = drive(scenario(), 0.25, still, torque=lambda _: np.zeros(6))
    moved = limp.arm[-1].q - calm.arm[-1].q
    assert abs(moved[0]) > 0.02


def test_slip_moves_the_truth_and_not_the_odometry() -> None:
    """The platform ends ``distance`` away; the odometry says that it stands."""
    slip = {"kind": "slip", "t": 0.3, "duration": 0.5, "distance": 0.05, "direction": 90.0}
    run = drive(scenario(slip), 1.2, still)
    assert run.pose[-1, 1] - run.pose[0, 1] == pytest.approx(0.05, abs=0.002)
    assert abs(run.pose[-1, 0]) < 0.002
    assert max(abs(o.pose[1]) for _, o in run.odometry) <= 0.002


def test_slip_is_a_motion_like_any_other() -> None:
    """While it slips, true velocity is the derivative of true pose, and the IMU feels it."""
    slip = {"kind": "slip", "t": 0.3, "duration": 0.5, "distance": 0.05, "direction": 0.0}
    run = drive(scenario(slip), 1.0, still)
    derivative = np.diff(run.pose, axis=0) / 0.001
    np.testing.assert_allclose(derivative, run.velocity[1:], atol=1e-9)
    felt = np.array([m.accel[0] for _, m in run.imu])
    assert felt.max() > 0.5 * 2 * np.pi * 0.05 / 0.5**2


def test_slip_while_driving_adds_to_the_drive() -> None:
    """The wheels go on as commanded: odometry and truth part by the distance slipped."""
    slip = {"kind": "slip", "t": 0.8, "duration": 0.4, "distance": 0.04, "direction": 90.0}
    run = drive(scenario(slip), 1.6, ahead)
    _, last = run.odometry[-1]
    true = run.pose[round(1000 * last.t)]
    assert true[1] - last.pose[1] == pytest.approx(0.04, abs=0.002)
    assert true[0] - last.pose[0] == pytest.approx(0.0, abs=0.002)


def test_yaw_bump_turns_a_driving_platform() -> None:
    """A bump's yaw acceleration is that of the platform."""
    bump = {"kind": "bump", "t": 0.8, "duration": 0.2, "yaw": 5.0, "amplitude": 0.0}
    run = drive(scenario(bump), 1.0, ahead)
    rates = np.gradient(run.velocity[:, 2], 0.001)[800:1000]
    assert np.abs(rates).max() == pytest.approx(5.0, rel=0.25)
