"""What the delayed filter knows is a function of what was measured, not of when it arrived."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from observer.belief import IMU, ODOMETRY
from observer.bench.manoeuvres import still, sway
from observer.bench.world import DT, ROBOT, World, simulate
from observer.delayed_ekf import DelayedEKF
from observer.filter_options import FilterOptions
from observer.observer import make_observer
from observer.observer_options import ObserverOptions, make_filter
from services.messages import BaseCommand, Estimate, Imu, Odometry, check
from services.topics import ESTIMATE
from services.wire.codec import decode, encode


def fresh(**options: object) -> DelayedEKF:
    """A filter for the example robot."""
    return make_filter(ROBOT, ObserverOptions(filter=FilterOptions(**options)))  # type: ignore[arg-type]


def feed(f: DelayedEKF, message: Odometry | Imu | BaseCommand, now: float = 1e9) -> bool:
    """Give one message to the filter."""
    if isinstance(message, Odometry):
        return f.add(ODOMETRY, message.t, message.pose, now)
    if isinstance(message, Imu):
        return f.add(IMU, message.t, (message.gyro[2], message.accel[0], message.accel[1]), now)
    return f.command(message.t + 0.0015, message.velocity)


@cache
def short_world() -> World:
    """1.2 s with a push, so that gate and trigger are part of the game."""
    return simulate(sway, seed=3, duration=1.2, pushes=(0.9,), slips=((0.95, 0.05, 0.03, 0.0),))


@cache
def in_order() -> DelayedEKF:
    """The answer when everything arrives in the order of sampling, fused one by one."""
    f = fresh()
    for _, m in sorted(short_world().arrivals, key=lambda a: a[1].t):
        feed(f, m)
        f.settle()
    return f


@given(seed=st.integers(0, 10**6), burst=st.integers(1, 20))
@settings(max_examples=25, deadline=None)
def test_arrival_order_does_not_matter(seed: int, burst: int) -> None:
    """Any order of arrival within the history gives bit for bit the answer of sampling order."""
    rng = np.random.default_rng(seed)
    messages = [m for _, m in short_world().arrivals]
    first = next(m for m in messages if isinstance(m, Odometry))
    delays = rng.uniform(0, 0.4, len(messages))  # within the history of 0.5 s
    order = np.argsort([m.t + d for m, d in zip(messages, delays, strict=True)])
    f = fresh()
    feed(f, first)
    for count, i in enumerate(order):
        if messages[i] is not first:
            assert feed(f, messages[i]) or messages[i].t <= first.t
        if count % burst == 0:
            f.settle()
    f.settle()
    a, b = f.belief, in_order().belief
    assert a.t == b.t
    assert np.array_equal(a.x, b.x) and np.array_equal(a.P, b.P)
    assert (a.odometry_gated, a.imu_gated, a.mode) == (
        b.odometry_gated,
        b.imu_gated,
        b.mode,
    )
    assert a.odometry_gated > 0 and a.mode.until > 0.9  # the world did exercise both


def test_a_late_measurement_changes_the_belief_as_if_in_time() -> None:
    """Late odometry has an effect, and exactly the effect it would have had in time."""
    late, missing = fresh(), fresh()
    messages = sorted((m for _, m in short_world().arrivals), key=lambda m: m.t)
    held = [m for m in messages if isinstance(m, Odometry)][-2]
    for m in messages:
        if m is not held:
            feed(late, m)
            feed(missing, m)
            late.settle()
    missing.settle()
    before = late.belief.x
    assert np.array_equal(before, missing.belief.x)
    feed(late, held)
    late.settle()
    assert not np.array_equal(late.belief.x, before)
    assert np.array_equal(late.belief.x, in_order().belief.x)


@pytest.mark.parametrize(
    ("sensor", "t", "z", "reason"),
    [
        (ODOMETRY, 1.15, (math.nan, 0, 0), "odometry: non-finite"),
        (IMU, math.inf, (0, 0, 0), "imu: non-finite"),
        (IMU, 1.3, (0, 0, 0), "imu: future"),
        (ODOMETRY, 1150 * DT, (0, 0, 0), "odometry: duplicate"),
        (IMU, 1150 * DT, (0, 0, 0), "imu: duplicate"),
        (ODOMETRY, 0.55, (0.0, 0.0, 0.0), "odometry: too_old"),
        (IMU, -3.0, (0, 0, 0), "imu: too_old"),
    ],
)
def test_refused_measurements_leave_no_trace(sensor: int, t: float, z: tuple, reason: str) -> None:
    """What cannot be used is refused, counted by reason, and the belief stays as it is."""
    f = fresh()
    for _, m in short_world().arrivals:
        feed(f, m)
    f.settle()
    x, count = f.belief.x, f.refused[reason]
    assert not f.add(sensor, t, z, now=1.22)
    f.settle()
    assert f.refused[reason] == count + 1
    assert f.rejected()[reason] == count + 1
    assert np.array_equal(f.belief.x, x)


def test_imu_before_any_odometry_is_refused() -> None:
    """Without a pose there is nothing to estimate."""
    f = fresh()
    assert not f.add(IMU, 0.0, (0, 0, 0), 0.0)
    assert f.rejected() == {"imu: before_start": 1}
    assert not f.started


def test_before_any_odometry_the_estimate_says_so_whatever_the_commands_are_stamped() -> None:
    """A command stamped in the future does not make what is said unfit to be sent."""
    observer = make_observer("ekf", ROBOT)
    ahead = BaseCommand(t=0.012, velocity=np.zeros(3))
    for now in (0.0, 0.002):
        estimate = observer.step(now, [], [], [ahead])
        decode(ESTIMATE, encode("observer", 0, estimate))  # refused if it is out of range
        assert estimate.reason == "no odometry yet"


def test_bad_commands_are_refused() -> None:
    """Commands that are not finite, too old or doubled are refused and counted."""
    f = fresh()
    f.add(ODOMETRY, 10.0, (0, 0, 0), 10.0)
    assert not f.command(math.nan, (0, 0, 0))
    assert not f.command(9.0, (0, 0, 0))
    assert f.command(10.0, (0.1, 0, 0)) and not f.command(10.0, (0.2, 0, 0))
    assert dict(f.refused) == {
        "command: non-finite": 1,
        "command: too_old": 1,
        "command: duplicate": 1,
    }


def test_history_is_bounded() -> None:
    """Memory does not grow with time."""
    f = fresh()
    for _, m in simulate(still, seed=1, duration=6.0).arrivals:
        feed(f, m)
        f.settle()
    assert len(f._events) == len(f._beliefs) < 100
    assert len(f.commands) < 40


def test_gate_refuses_a_wild_pose_but_never_for_ever() -> None:
    """One wild odometry is refused; a lasting offset is accepted within 0.5 s, then tracked."""
    f = fresh()
    for k in range(40):
        f.add(ODOMETRY, 0.05 * k, (0.0, 0.0, 0.0), 1e9)
    f.settle()
    f.add(ODOMETRY, 2.0, (0.3, 0.0, 0.0), 1e9)
    f.settle()
    assert f.belief.odometry_gated == 1 and abs(f.belief.x[0]) < 1e-3
    for k in range(1, 11):
        f.add(ODOMETRY, 2.0 + 0.05 * k, (0.3, 0.0, 0.0), 1e9)
    f.settle()
    assert f.belief.odometry_refused == 0
    assert f.belief.x[0] == pytest.approx(0.3, abs=2e-3)
    assert f.belief.P[2, 2] < math.radians(0.2) ** 2  # heading agreed all the time: kept


def test_heading_is_continuous_across_pi() -> None:
    """Odometry wraps its heading; the belief does not, and no innovation jumps by a turn."""
    f = fresh()
    for k in range(200):
        heading = 3.0 + 0.4 * 0.05 * k
        wrapped = (heading + math.pi) % (2 * math.pi) - math.pi
        f.command(0.05 * k - 0.05, (0.0, 0.0, 0.4))
        f.add(ODOMETRY, 0.05 * k, (0.0, 0.0, wrapped), 1e9)
        f.settle()
        assert abs(f.belief.odometry_innovation[2]) < 0.05
    assert f.belief.x[2] == pytest.approx(3.0 + 0.4 * 0.05 * 199, abs=0.01)
    assert f.belief.odometry_gated == 0


def test_a_push_raises_the_disturbance_at_once() -> None:
    """A push shows as NIS of the IMU, which raises the disturbance within two readings."""
    f = fresh()
    world = simulate(still, seed=5, duration=3.0, disturbance=0.0, pushes=(2.5,))
    alert = None
    for _, m in world.arrivals:
        feed(f, m)
        f.settle()
        if alert is None and f.started and f.belief.mode.until > f.belief.t:
            alert = f.belief.t
    assert alert == pytest.approx(2.505, abs=0.016)
    assert f.belief.imu_gated == 0


def test_covariance_stays_symmetric_and_positive() -> None:
    """After 20 s of sway the covariance is still a covariance."""
    f = fresh()
    for _, m in simulate(sway, seed=6, duration=20.0).arrivals:
        feed(f, m)
        f.settle()
    P = f.belief.P
    scale = np.sqrt(np.diag(P))
    correlation = P / np.outer(scale, scale)
    np.testing.assert_allclose(correlation, correlation.T, atol=1e-9)
    assert np.linalg.eigvalsh(0.5 * (correlation + correlation.T)).min() > 0


def test_unknown_update_is_refused_with_the_valid_names() -> None:
    """A mistyped option lists what there is."""
    with pytest.raises(ValueError, match="interval, gaussian"):
        fresh(odometry_update="intervall")


NUMBERS = st.one_of(st.floats(-1, 1), st.floats(-1e5, 1e5))


@given(
    data=st.lists(
        st.tuples(st.sampled_from("oic"), st.floats(-0.2, 0.02), NUMBERS, NUMBERS, NUMBERS),
        max_size=60,
    )
)
@settings(max_examples=60, deadline=None)
def test_nonsense_within_range_never_breaks_the_observer(data: list) -> None:
    """Whatever the wire lets through, no exception, and the estimate is finite or invalid."""
    o = make_observer("ekf", ROBOT)
    now = 0.0
    o.step(now, [Odometry(t=0.0, pose=np.zeros(3))])
    for kind, age, a, b, c in data:
        now += 0.01
        values = np.clip([a, b, c], *{"o": (-1e5, 1e5), "i": (-50, 50), "c": (-10, 10)}[kind])
        t = now + age
        e = o.step(
            now,
            [Odometry(t=t, pose=values)] if kind == "o" else [],
            [Imu(t=t, gyro=values[::-1], accel=10 * values)] if kind == "i" else [],
            [BaseCommand(t=t, velocity=values)] if kind == "c" else [],
        )
        check(Estimate, {f: getattr(e, f) for f in e.__dataclass_fields__})
        assert np.linalg.eigvalsh(e.covariance).min() > -1e-6 * np.diag(e.covariance).max()


def test_kidnapped_robot() -> None:
    """Odometry 50 m away is believed in the end; the jump is announced as invalid, then valid."""
    o = make_observer("ekf", ROBOT)
    said = []
    for k in range(400):
        t = 0.01 * k
        x = 0.0 if t < 2.0 else 50.0
        e = o.step(t, [Odometry(t=t, pose=np.array([x, 0.0, 0.0]))] if k % 5 == 0 else [])
        said.append((e.valid, e.reason, e.pose[0]))
    jump = next(i for i, s in enumerate(said) if s[2] > 1.0)
    assert 2.0 < 0.01 * jump < 3.0
    assert not said[jump - 1][0] and not said[jump][0] and "reset" in said[jump][1]
    assert said[-1][0] and said[-1][2] == pytest.approx(50.0, abs=2e-3)


def test_a_long_silence_costs_no_long_tick() -> None:
    """After 60 s without a sensor the filter starts afresh at the next odometry, biases kept."""
    f = fresh()
    for _, m in simulate(sway, seed=2, duration=6.0).arrivals:
        feed(f, m)
        f.settle()
    bias = f.belief.x[9:].copy()
    for k in range(1200):
        f.command(6.1 + 0.05 * k, (0.1, 0.0, 0.0))
        f.settle()
    assert len(f.commands) < 150
    assert not f.add(IMU, 66.0, (0, 0, 0), 66.0)
    assert f.add(ODOMETRY, 66.05, (5.0, 0.0, 0.0), 66.1)
    f.settle()
    assert len(f._events) == 1 and f.belief.x[0] == 5.0
    assert np.array_equal(f.belief.x[9:], bias) and bias.any()
