"""The observer's models say what the equations say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter
from hypothesis import given, settings
from hypothesis import strategies as st

from observer.commands import CommandHistory
from observer.motion_model import SIZE, MotionModel
from observer.sensor_models import ImuModel, OdometryModel, truncated, wrap
from observer.update import update3

MODEL = MotionModel(0.15, (1.5, 1.5, 3.0), (0.075, 0.075, 0.15))
IMU = ImuModel(MODEL, (0.2, 0.05), 1e-3, 0.03)


def random_state(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """State and command; the command is far enough away to saturate an axis now and then."""
    rng = np.random.default_rng(seed)
    spread = [1, 1, 2, 0.4, 0.4, 0.4, 0.3, 0.3, 0.3, 0.01, 0.05, 0.05, 0.1, 0.1]
    x = rng.standard_normal(SIZE) * spread
    return x, x[3:6] + rng.uniform(-0.4, 0.4, 3)


def difference(f, x: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Central finite differences of f in x."""
    columns = []
    for i in range(len(x)):
        e = np.zeros(len(x))
        e[i] = step
        columns.append((np.array(f(x + e)) - np.array(f(x - e))) / (2 * step))
    return np.array(columns).T


@given(seed=st.integers(0, 10_000), dt=st.floats(1e-4, 0.05))
@settings(max_examples=60, deadline=None)
def test_motion_jacobian_is_the_derivative(seed: int, dt: float) -> None:
    """The transition's Jacobian equals finite differences, saturated axes included."""
    x, u = random_state(seed)
    gap = np.abs(np.abs(u - x[3:6]) - np.array([0.225, 0.225, 0.45]))
    if gap.min() < 1e-4:  # on the corner of the clip there is no derivative
        return
    fd = difference(lambda s: MODEL.advance(s, u, dt), x)
    np.testing.assert_allclose(MODEL.jacobian(x, u, dt), fd, atol=2e-9)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_imu_jacobian_is_the_derivative(seed: int) -> None:
    """The inertial measurement's Jacobian equals finite differences."""
    x, u = random_state(seed)
    gap = np.abs(np.abs(u - x[3:6]) - np.array([0.225, 0.225, 0.45]))
    if gap.min() < 1e-4:
        return
    np.testing.assert_allclose(
        IMU.jacobian(x, u), difference(lambda s: IMU.expect(s, u), x), atol=1e-8
    )


@pytest.mark.parametrize("seed", range(5))
def test_closed_form_equals_small_steps(seed: int) -> None:
    """10 ms in closed form equal 1000 Euler steps of the stated differential equation."""
    x, u = random_state(seed)
    u = x[3:6] + np.clip(u - x[3:6], -0.2, 0.2)
    small, n, dt = x.copy(), 1000, 1e-5
    for _ in range(n):
        c, s = math.cos(small[2]), math.sin(small[2])
        rate = np.zeros(SIZE)
        rate[:3] = c * small[3] - s * small[4], s * small[3] + c * small[4], small[5]
        rate[3:6] = (u - small[3:6]) / 0.15 + small[6:9]
        rate[6:9] = -small[6:9] / 0.3
        small = small + dt * rate
    np.testing.assert_allclose(MODEL.advance(x, u, 0.01), small, atol=2e-6)


def test_process_noise_is_that_of_the_disturbance() -> None:
    """Q equals the integral of F q F' over the step, to the stated few per cent, and is PSD."""
    dt, n = 0.01, 400
    heading = 0.7
    x = np.zeros(SIZE)
    x[2] = heading
    exact = np.zeros((SIZE, SIZE))
    for k in range(n):
        f = MODEL.jacobian(x, (0, 0, 0), (k + 0.5) * dt / n)
        q = np.zeros((SIZE, SIZE))
        q[range(6, 9), range(6, 9)] = 2 * np.square(MODEL.disturbance) / MODEL.correlation
        exact += f @ q @ f.T * dt / n
    got = MODEL.process_noise(heading, dt)
    scale = np.sqrt(np.outer(np.diag(exact)[:9], np.diag(exact)[:9]))
    assert np.max(np.abs(got[:9, :9] - exact[:9, :9]) / scale) < 0.08
    assert np.linalg.eigvalsh(got).min() > -1e-15


def test_imu_sees_the_lever_arm() -> None:
    """Turning at constant rate in place shows the centripetal term -w^2 p, and nothing else."""
    x = np.zeros(SIZE)
    x[5] = 2.0
    expected = [2.0, -4.0 * 0.2, -4.0 * 0.05]
    np.testing.assert_allclose(IMU.expect(x, (0.0, 0.0, 2.0)), expected, atol=1e-12)


@given(mean=st.floats(-3, 3), sd=st.floats(0.05, 3))
@settings(max_examples=60, deadline=None)
def test_truncated_moments(mean: float, sd: float) -> None:
    """Moments of a Gaussian within an interval equal numerical integration."""
    got = truncated(mean, sd * sd, -0.5, 0.5)
    grid = (np.arange(20000) + 0.5) / 20000 - 0.5
    weight = np.exp(-0.5 * ((grid - mean) / sd) ** 2)
    if got is None:
        mass = weight.sum() / 20000 / (sd * math.sqrt(2 * math.pi))
        assert mass < 1.1e-4
        return
    m = np.average(grid, weights=weight)
    v = np.average((grid - m) ** 2, weights=weight)
    np.testing.assert_allclose(got, (m, v), rtol=1e-3, atol=1e-5)


def test_commands_are_held_then_dropped() -> None:
    """A command acts from its instant until the next or until the watchdog; pieces add up."""
    history = CommandHistory(silence=0.15)
    a, b = (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)
    assert history.insert(1.0, a) and history.insert(1.05, b)
    assert not history.insert(1.05, a)
    pieces = history.segments(0.98, 1.3)
    assert [u for _, u in pieces] == [(0, 0, 0), a, b, (0, 0, 0)]
    np.testing.assert_allclose([d for d, _ in pieces], [0.02, 0.05, 0.15, 0.10])
    assert history.at(0.99) == (0, 0, 0) and history.at(1.0) == a and history.at(1.21) == (0, 0, 0)
    assert history.still_since(1.1) == 0.0
    assert history.still_since(1.3) == pytest.approx(0.10)


def test_wrap_takes_the_short_way() -> None:
    """Angles wrap into [-pi, pi)."""
    assert wrap(math.radians(190)) == pytest.approx(math.radians(-170))
    assert wrap(-math.pi) == -math.pi


def test_bad_time_constants_are_refused() -> None:
    """A correlation time equal to the lag, or a negative lag, is refused with the reason."""
    with pytest.raises(ValueError, match="differ"):
        MotionModel(0.15, (1, 1, 1), (1, 1, 1), correlation=0.15)
    with pytest.raises(ValueError, match="positive"):
        MotionModel(-0.1, (1, 1, 1), (1, 1, 1))


def test_rounding_as_noise() -> None:
    """R of rounded odometry is q^2 / 12, plus what noise there is before rounding."""
    r = OdometryModel((0.001, 0.001, 0.002), (0.0, 0.001, 0.0)).covariance()
    np.testing.assert_allclose(np.diag(r), [1e-6 / 12, 1e-6 / 12 + 1e-6, 4e-6 / 12])


@given(seed=st.integers(0, 2**32 - 1))
def test_update_equals_that_of_filterpy(seed: int) -> None:
    """State and covariance are those of filterpy's Joseph form; the covariance is symmetric."""
    rng = np.random.default_rng(seed)
    root, spread = rng.normal(size=(SIZE, SIZE)), np.diag(rng.uniform(1e-3, 1.0, 3))
    P, H, R = root @ root.T, rng.normal(size=(3, SIZE)), spread @ spread
    x, z = rng.normal(size=SIZE), rng.normal(size=3)
    other = ExtendedKalmanFilter(dim_x=SIZE, dim_z=3)
    other.x, other.P = x, P
    other.update(z, lambda x: H, lambda x: H @ x, R=R)
    got_x, got_P, nis, S = update3(x, P, z - H @ x, H, R)
    np.testing.assert_allclose(got_x, other.x, atol=1e-8 * np.abs(other.x).max())
    np.testing.assert_allclose(got_P, other.P, atol=1e-8 * np.abs(P).max())
    np.testing.assert_array_equal(got_P, got_P.T)
    np.testing.assert_allclose(S, other.S)
    np.testing.assert_allclose(nis, other.y @ other.SI @ other.y, rtol=1e-6)
