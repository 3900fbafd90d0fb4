"""The output: smooth, consistent in itself, and at any rate."""

from __future__ import annotations

import math

import numpy as np
import pytest

from observer.baselines import Hold, Taylor, TruthReference
from observer.bench.manoeuvres import sway
from observer.bench.play import run
from observer.bench.world import ROBOT, simulate
from observer.metrics import chi2_band, chi2_quantile, jitter, largest_step, nees, nis, rms
from observer.observer import KINDS, make_observer
from observer.output import SmoothOutput
from services.messages import BaseCommand, Estimate, Imu, Odometry, check


def odometry(t: float, x: float, heading: float = 0.0) -> Odometry:
    """A pose on the x axis."""
    return Odometry(t=t, pose=np.array([x, 0.0, heading]))


@pytest.mark.parametrize("slips", [(), ((4.0, 0.1, 0.05, 0.0),)])
def test_velocity_is_the_derivative_of_pose(slips: tuple) -> None:
    """The mean of two velocities times dt is the change of pose, to rounding, slip or not."""
    r = run(make_observer("ekf", ROBOT), simulate(sway, 1000, 7.0, slips=slips)).after(0.1)
    moved = np.diff(r.pose, axis=0)
    mean = 0.5 * (r.velocity[1:] + r.velocity[:-1]) * 0.002
    assert np.abs(moved - mean).max() < 1e-12
    assert np.abs(moved).max() > 1e-4


def test_acceleration_is_bounded_and_true() -> None:
    """Velocity has no step: its change per tick is the published acceleration's and 3 m/s^2."""
    r = run(make_observer("ekf", ROBOT), simulate(sway, 1000, 10.0)).after(1.0)
    correction = np.diff(r.velocity, axis=0) / 0.002 - r.acceleration[1:]
    assert np.abs(correction[:, :2]).max() < 3.0 * math.sqrt(2) + 0.3
    assert rms((r.acceleration - r.true_acceleration)[:, :2]) < 0.06
    assert rms(r.true_acceleration[:, :2]) > 0.2


@pytest.mark.parametrize("step", [1, 4, 10, 37])
def test_any_rate(step: int) -> None:
    """At 1000 Hz or 27 Hz the answer is the same to a fraction of the error."""
    world = simulate(sway, 1001, 9.0)
    r = run(make_observer("ekf", ROBOT), world, step).after(5.0)
    assert rms((r.pose - r.true_pose)[:, :2]) < 0.7e-3
    assert math.degrees(rms((r.pose - r.true_pose)[:, 2])) < 0.015
    assert all(e.valid for e in r.estimates)


def test_output_closes_an_error() -> None:
    """5 mm of error are fed in at no more than the rate, with no step, overshooting < 1 %."""
    out = SmoothOutput()
    out.reset((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    out.trust((0.002, 0.0))
    xs, vs = [], []
    for _ in range(1000):
        out.step(0.002, (0, 0, 0), (0.005, 0.0, math.radians(0.2)), (0, 0, 0))
        xs.append(out.pose[0])
        vs.append(out.velocity[0])
    assert max(vs) <= out.rate[0] * 0.005 / out.options.far[0] + 1e-9
    assert np.abs(np.diff(vs)).max() <= out.options.acceleration[0] * 0.002 + 1e-12
    assert max(xs) < 0.00502
    assert xs[-1] == pytest.approx(0.005, abs=1e-6)
    assert out.pose[2] == pytest.approx(math.radians(0.2), abs=1e-6)


def test_before_the_first_odometry() -> None:
    """Nothing known: invalid, with the reason, and still a message the wire accepts."""
    o = make_observer("ekf", ROBOT)
    imu = Imu(t=0.0, gyro=np.zeros(3), accel=np.zeros(3))
    command = BaseCommand(t=0.0, velocity=np.zeros(3))
    e = o.step(0.01, [], [imu], [command])
    assert not e.valid and e.reason == "no odometry yet" and e.t == 0.01
    check(Estimate, {f: getattr(e, f) for f in e.__dataclass_fields__})


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_speaks_the_vocabulary(kind: str) -> None:
    """Every observer yields estimates that the wire accepts, stamped now."""
    o = make_observer(kind, ROBOT)
    if isinstance(o, TruthReference):
        o.tell(0.0, np.ones(3), np.zeros(3), np.zeros(3))
    for k in range(100):
        z = [odometry(0.002 * k - 0.02, 0.001)] if k % 25 == 10 else []
        e = o.step(0.002 * k, z, [], [])
        assert e.t == 0.002 * k
        check(Estimate, {f: getattr(e, f) for f in e.__dataclass_fields__})
    assert e.valid


def test_unknown_kind_lists_the_valid_ones() -> None:
    """A mistyped kind says what there is."""
    with pytest.raises(ValueError, match="ekf, imm, undelayed, taylor, hold, truth"):
        make_observer("kalman", ROBOT)


def test_bad_input_never_raises() -> None:
    """Nonsense is counted in the estimate, which stays where it was."""
    o = make_observer("ekf", ROBOT)
    for k in range(50):
        o.step(0.02 * k, [odometry(0.02 * k, 0.0)], [], [])
    bad = Imu(t=0.99, gyro=np.full(3, math.nan), accel=np.zeros(3))
    e = o.step(
        1.0,
        [odometry(math.nan, 0.0), odometry(5.0, 0.0), odometry(0.1, 0.0)],
        [bad],
        [BaseCommand(t=1.0, velocity=np.array([math.inf, 0, 0]))],
    )
    assert e.rejected == {
        "odometry: non-finite": 1,
        "odometry: future": 1,
        "odometry: too_old": 1,
        "imu: non-finite": 1,
        "command: non-finite": 1,
    }
    assert e.valid and np.abs(e.pose).max() < 1e-3


def test_clock_going_backwards() -> None:
    """A small step back holds the output; a restart of robot time starts the observer afresh."""
    o = make_observer("ekf", ROBOT)
    for k in range(100):
        e = o.step(0.02 * k, [odometry(0.02 * k, 1.0)], [], [])
    back = o.step(1.9, [], [], [])
    assert back.t == 1.9 and np.array_equal(back.pose, e.pose)
    again = o.step(0.0, [odometry(0.0, 2.0)], [], [])
    assert again.valid and again.pose[0] == pytest.approx(2.0)
    assert again.rejected["clock: backwards"] == 1


def test_taylor_follows_polynomials() -> None:
    """Order n is exact on a polynomial of degree n, and order 0 is hold."""
    times = 0.05 * np.arange(6)
    for order in range(1, 4):
        o = Taylor(ROBOT, order)
        batch = [odometry(t, 0.1 * t**order, 6.0 * t) for t in times]
        e = o.step(0.30, batch)
        assert e.pose[0] == pytest.approx(0.1 * 0.30**order)
        assert e.velocity[0] == pytest.approx(0.1 * order * 0.30 ** (order - 1))
        assert e.pose[2] == pytest.approx(1.8)
    held = Hold(ROBOT).step(0.30, [odometry(t, t) for t in times])
    assert held.pose[0] == times[-1] and not held.velocity.any()


def test_truth_reference_echoes() -> None:
    """The reference says what it was told, and nothing before."""
    o = TruthReference()
    assert not o.step(0.0).valid
    o.tell(1.0, np.array([1.0, 2.0, 3.0]), np.array([1.0, 0.0, 0.0]), np.zeros(3))
    e = o.step(1.1)
    np.testing.assert_allclose(e.pose, [1.1, 2.0, 3.0])
    np.testing.assert_allclose(e.velocity, [1.0, 0.0, 0.0])


def test_metrics() -> None:
    """The figures mean what they say, on data where the answer is known."""
    rng = np.random.default_rng(1)
    sd = np.array([1.0, 2.0, 0.5])
    e = rng.standard_normal((4000, 3)) * sd
    values = nees(e, np.broadcast_to(np.diag(sd**2), (4000, 3, 3)))
    low, high = chi2_band(3, 4000, 0.999)
    assert low < values.mean() < high
    assert not low < nees(e, np.broadcast_to(np.diag(sd**2) * 1.2, (4000, 3, 3))).mean() < high
    assert nis(np.array([2.0, 0.0]), np.diag([4.0, 1.0])) == pytest.approx(1.0)
    assert chi2_quantile(0.95, 3) == pytest.approx(7.815, rel=0.01)
    assert chi2_band(3, 100) == pytest.approx((2.54, 3.50), abs=0.02)
    assert rms(np.array([3.0, -4.0])) == pytest.approx(math.sqrt(12.5))
    pose = np.zeros((5, 3))
    pose[3:, 0] = 0.01
    assert largest_step(pose, np.zeros((5, 3))) == (pytest.approx(0.01), 0.0)
    t = 0.002 * np.arange(2000)
    wave = np.stack([np.sin(2 * np.pi * 100 * t), np.sin(2 * np.pi * 0.5 * t)], axis=1)
    fast, slow = jitter(wave, np.zeros_like(wave), 0.002)
    assert fast > 0.6 and slow < 0.05
