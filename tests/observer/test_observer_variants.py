"""Other sensors, other mountings, longer delays: the same observer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deploy.robot import MobileBase
from observer.belief import IMU, ODOMETRY
from observer.bench.manoeuvres import sway, turns
from observer.bench.play import run, ticks
from observer.bench.world import ROBOT, World, simulate
from observer.delayed_ekf import DelayedEKF
from observer.ekf_observer import EkfObserver
from observer.metrics import largest_step, rms
from observer.modes import Mode
from observer.observer_options import ObserverOptions, make_filter
from observer.wheel_scale import WheelScale
from services.messages import BaseCommand, Imu, Odometry, WheelSpeed


def told(robot: MobileBase, **sensor: dict[str, Any]) -> MobileBase:
    """A robot with other facts, as ``odometry={"scale": ...}``."""
    change = {k: getattr(robot, k).model_copy(update=v) for k, v in sensor.items()}
    return robot.model_copy(update=change)


def feed(f: DelayedEKF, m: Odometry | Imu | BaseCommand) -> None:
    """Give one message to a filter that has no clock."""
    if isinstance(m, Odometry):
        f.add(ODOMETRY, m.t, m.pose, 1e9)
    elif isinstance(m, Imu):
        f.add(IMU, m.t, (m.gyro[2], m.accel[0], m.accel[1]), 1e9)
    elif isinstance(m, BaseCommand):
        f.command(m.t + 0.0015, m.velocity)


@given(seed=st.integers(0, 10**6), budget=st.integers(1, 6))
@settings(max_examples=15, deadline=None)
def test_a_replay_spread_over_ticks_ends_at_the_same_belief(seed: int, budget: int) -> None:
    """Whatever the order of arrival and the budget, once settled the belief is the exact one."""
    messages = [m for _, m in simulate(sway, seed=4, duration=1.0, pushes=(0.6,)).arrivals]
    first = next(m for m in messages if isinstance(m, Odometry))
    spread, exact = (make_filter(ROBOT, ObserverOptions()) for _ in range(2))
    for m in sorted(messages, key=lambda m: m.t):
        feed(exact, m)
    exact.settle()
    delay = np.random.default_rng(seed).uniform(0.0, 0.4, len(messages))
    feed(spread, first)
    for i in np.argsort([m.t + d for m, d in zip(messages, delay, strict=True)]):
        if messages[i] is not first:
            feed(spread, messages[i])
        spread.settle(budget)
        assert spread.belief.t <= messages[-1].t
    while not spread.settled:
        spread.settle(budget)
    assert np.array_equal(spread.belief.x, exact.belief.x)
    assert np.array_equal(spread.belief.P, exact.belief.P)
    assert spread.belief.mode == exact.belief.mode


@pytest.mark.parametrize("delay", [0.1, 0.4])
def test_long_delays_cost_accuracy_but_no_long_tick(delay: float) -> None:
    """Odometry 0.1 and 0.4 s late: still smooth, and no tick fuses more than a few measurements."""
    world = simulate(sway, 1001, 12.0, odometry_delay=delay)
    observer = EkfObserver(world.robot)
    count, most, worst = [0], 0, []
    fuse = observer.filter.ekf.fuse

    def counted(*args: Any) -> Any:
        count[0] += 1
        return fuse(*args)

    observer.filter.ekf.fuse = counted  # type: ignore[method-assign]
    poses = []
    for tick in ticks(world, 2):
        count[0] = 0
        e = observer.step(tick.now, tick.odometry, tick.imu, tick.commands)
        new = len(tick.odometry) + len(tick.imu)
        most = max(most, count[0] - new)
        poses.append(e.pose)
        worst.append(count[0])
    assert most <= observer.options.filter.replay
    assert max(worst) > 1
    keep = slice(2500, None)
    truth = world.pose[::2][keep]
    error = np.array(poses)[keep] - truth
    assert rms(error[:, :2]) < (1e-3 if delay < 0.2 else 3e-3)
    assert largest_step(np.array(poses)[keep], truth)[0] / 2 < 0.025e-3


def test_a_tilted_floor_is_told_from_a_bias_by_turning() -> None:
    """With 0.5 deg of tilt and turns, accuracy is that of a level floor; a bias alone fails."""
    g = 9.81 * math.sin(math.radians(0.5))
    world = simulate(turns, 1003, 20.0, tilt=(g, 0.0))
    level = simulate(turns, 1003, 20.0)

    def error(w: World, tilt: float) -> float:
        options = ObserverOptions()
        options = ObserverOptions(filter=type(options.filter)(floor_tilt=tilt))
        r = run(EkfObserver(w.robot, options), w).after(5.0)
        return rms((r.pose - r.true_pose)[:, :2])

    assert error(world, 0.02) < 1.3 * error(level, 0.02)
    assert error(world, 1e-9) > 1.5 * error(world, 0.02)


def test_wheels_of_the_wrong_size_are_corrected_if_described() -> None:
    """Told that its wheels read 2 % too much, the estimate is that of the path truly driven."""
    world = simulate(turns, 1004, 15.0, scale=(1.02, 0.98))
    right = run(EkfObserver(told(ROBOT, odometry={"scale": (1.02, 0.98)})), world)
    wrong = run(EkfObserver(ROBOT), world)

    def error(r: Any) -> float:
        return rms((r.pose - r.true_pose)[-500:, :2])

    assert error(right) < 1e-3 and 5 * error(right) < error(wrong)


def test_scale_correction_adds_up_increments() -> None:
    """A square driven with wheels that read too much closes where the true one does."""
    wheels = WheelScale((1.1, 1.0))
    corners = [(0, 0, 0), (1.1, 0, 0), (1.1, 0, 90), (1.1, 1.1, 90), (1.1, 1.1, 180)]
    for t, (x, y, deg) in enumerate(corners):
        pose = wheels.correct(float(t), np.array([x, y, math.radians(deg)]))
    np.testing.assert_allclose(pose, [1.0, 1.0, math.pi], atol=1e-12)


@pytest.mark.parametrize("rotation", [(0.5 * math.pi, 0.0, 0.0), (0.1, -0.2, 2.5)])
def test_a_mounting_that_is_described_makes_no_difference(
    rotation: tuple[float, float, float],
) -> None:
    """An IMU on its side gives the estimate of one that lies flat."""
    turned = simulate(sway, 1005, 8.0, imu_rotation=rotation)
    flat = simulate(sway, 1005, 8.0)
    a = run(EkfObserver(told(ROBOT, imu={"rotation": rotation})), turned).after(5.0)
    b = run(EkfObserver(ROBOT), flat).after(5.0)
    error = [rms((r.pose - r.true_pose)[:, :2]) for r in (a, b)]
    assert error[0] < 1.5 * error[1] + 1e-4


def test_wheel_speeds_instead_of_poses() -> None:
    """From speeds alone the path is dead-reckoned: it drifts by little and its sigma grows."""
    world = simulate(sway, 1006, 12.0, heading=0.0)
    robot = told(ROBOT, odometry={"speed_noise": (0.005, 0.005, 0.01)})
    observer = EkfObserver(robot)
    rng = np.random.default_rng(0)
    first, estimates = world.pose[0], []
    for tick in ticks(world, 2):
        speeds = []
        if round(tick.now * 1000) % 50 == 20:
            k = round(tick.now * 1000) - 20
            c, s = math.cos(world.pose[k, 2]), math.sin(world.pose[k, 2])
            vx, vy, w = world.velocity[k]
            v = np.array([c * vx + s * vy, c * vy - s * vx, w])
            v += rng.standard_normal(3) * (0.005, 0.005, 0.01)
            speeds = [WheelSpeed(t=k * 0.001, velocity=v)]
        e = observer.step(tick.now, (), tick.imu, tick.commands, speeds)
        estimates.append(e)
    error = estimates[-1].pose - (world.pose[::2][-1] - first)
    sigma = np.sqrt(np.diag(estimates[-1].covariance)[:3])
    assert np.hypot(*error[:2]) < 0.02 and (np.abs(error) < 4 * sigma).all()
    assert sigma[0] > 1.4 * math.sqrt(estimates[3000].covariance[0, 0])


def test_the_mode_is_said() -> None:
    """Standing, driving and disturbed are told apart on evidence, and reported."""

    def command(t: float) -> tuple[float, float, float]:
        return (0.2, 0.0, 0.0) if 2.0 < t < 4.0 else (0.0, 0.0, 0.0)

    world = simulate(command, 1007, 7.0, brakes=0.3, pushes=(3.0,), disturbance=0.2)
    modes = {e.t: e.mode for e in run(EkfObserver(ROBOT), world).estimates}

    def share(mode: Mode, start: float, end: float) -> float:
        return float(np.mean([m == mode for t, m in modes.items() if start <= t < end]))

    assert share(Mode.STANDING, 1.5, 2.0) == 1.0
    assert share(Mode.STANDING, 2.15, 4.0) == 0.0
    assert share(Mode.DISTURBED, 3.03, 3.2) == 1.0
    assert share(Mode.DISTURBED, 2.2, 3.0) == 0.0
    assert share(Mode.STANDING, 6.0, 7.0) == 1.0
