"""Profiles along a path, and the joint reference that follows them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.nodes.profile import Profile
from arm.reference import ACCELERATION, FADE, KEPT, JointReference
from services.messages import Array

DT = 0.001
LIMIT = np.array([1.5, 1.0, 2.0, 4.0, 3.0, 4.0])
FREE = np.full(6, np.inf)
"""Joints that turn without end."""


def ride(profile: Profile) -> tuple[Array, Array]:
    """Arc lengths and speeds until the end."""
    out = [(0.0, 0.0)]
    while not profile.done:
        out.append(profile.step(DT))
        assert len(out) < 60_000
    s, v = np.array(out).T
    return s, v


@given(
    st.floats(1e-5, 0.5),
    st.floats(0.01, 0.3),
    st.floats(0.05, 0.5),
)
@settings(deadline=None, max_examples=40, derandomize=True)
def test_profile_ends_exactly_and_keeps_its_bounds(
    length: float, speed: float, acceleration: float
) -> None:
    """The end is the length at rest; speed and acceleration stay within their bounds."""
    s, v = ride(Profile(length, speed, acceleration))
    assert s[-1] == pytest.approx(length, abs=1e-12)
    assert v[-1] == pytest.approx(0.0, abs=1e-12)
    assert (np.diff(s) >= -1e-15).all()
    assert v.max() <= speed * (1 + 1e-9)
    assert np.abs(np.diff(v)).max() <= acceleration * DT * (1 + 1e-6)


def test_profile_speed_is_the_derivative_of_arc_length() -> None:
    """Trapezoids of the speed add up to the arc length, tick by tick."""
    s, v = ride(Profile(0.05, 0.04, 0.1))
    # the last tick is shorter than the others
    np.testing.assert_allclose(np.diff(s)[:-1], 0.5 * (v[1:] + v[:-1])[:-1] * DT, atol=1e-9)


def test_short_profile_never_cruises() -> None:
    """A path too short for its speed keeps the acceleration and gives the speed up."""
    s, v = ride(Profile(0.001, 0.3, 0.1))
    assert v.max() < 0.011
    assert s[-1] == pytest.approx(0.001)


def test_profile_of_no_length_is_over_at_once() -> None:
    """No way to go is no error."""
    profile = Profile(0.0, 0.1, 0.1)
    assert profile.done
    assert profile.step(DT) == (0.0, 0.0)


@pytest.mark.parametrize(("speed", "acceleration"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0)])
def test_profile_refuses_what_cannot_move(speed: float, acceleration: float) -> None:
    """A speed or acceleration that is not positive is refused."""
    with pytest.raises(ValueError, match="must be positive"):
        Profile(1.0, speed, acceleration)


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_switching_modes_never_jumps_the_rate(seed: int) -> None:
    """However modes follow each other, rates change by no more than the fade's acceleration."""
    rng = np.random.default_rng(seed)
    reference = JointReference(LIMIT, -FREE, FREE)
    rates = [reference.qd]
    for _ in range(6):
        wanted = rng.uniform(-0.7, 0.7, 6) * LIMIT
        reference.switch()
        for _ in range(int(rng.integers(1, 300))):
            reference.advance(DT)
            reference.follow(wanted, DT)
            rates.append(reference.qd)
    steps = np.abs(np.diff(rates, axis=0)).max()
    # the fade ends where it should; while it lasts it is bounded
    assert steps <= ACCELERATION * DT * 1.01


def test_fade_ends_at_the_wanted_rates() -> None:
    """After the fade the reference does exactly what the new mode wants."""
    reference = JointReference(LIMIT, -FREE, FREE)
    reference.follow(0.01 * np.ones(6), DT)
    reference.switch()
    for _ in range(round(FADE / DT) + 2):
        reference.follow(-0.01 * np.ones(6), DT)
    np.testing.assert_allclose(reference.qd, -0.01 * np.ones(6), atol=1e-12)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("left", [0.05, 0.07, 0.3])
def test_coming_to_rest_ends_before_the_end_of_a_joints_range(left: float, sign: float) -> None:
    """A slow joint near its end brakes in time, though another one alone would be gentler."""
    rates = sign * np.array([-0.77, 0.0, -0.2, -0.7, 0.235, 0.1])
    end = np.full(6, 9.0)
    reference = JointReference(LIMIT, -end - left, end + left)
    reference.reset(np.array([0.0, 0.0, 0.0, 0.0, sign * 9.0, 0.0]))
    reference.follow(rates, DT)
    reference.switch()
    steps = []
    while reference.qd.any():
        before = reference.qd
        reference.advance(DT)
        reference.follow(np.zeros(6), DT)
        steps.append(np.abs(reference.qd - before).max())
    assert sign * reference.q[4] <= 9.0 + left - KEPT + 1e-3
    needed = 1.5 * 0.77 * 0.235 / (2.0 * (left - KEPT))
    assert max(steps) <= max(ACCELERATION, needed) * DT * 1.05  # a tick at a time


def test_clamping_keeps_the_direction() -> None:
    """Rates beyond a limit shrink together, to the limit of the worst joint, and it is said."""
    reference = JointReference(LIMIT, -FREE, FREE)
    wanted = np.array([0.3, -4.0, 0.5, 0.0, 6.0, -0.1])
    reference.follow(wanted, DT)
    assert reference.clamped
    assert np.max(np.abs(reference.qd) / LIMIT) == pytest.approx(1.0)
    np.testing.assert_allclose(reference.qd / 0.25, wanted, atol=1e-12)
    reference.follow(0.1 * wanted, DT)
    assert not reference.clamped


def test_positions_integrate_the_rates_of_the_tick_before() -> None:
    """Advance moves with what was followed last."""
    reference = JointReference(LIMIT, -FREE, FREE)
    reference.reset(np.ones(6))
    reference.follow(0.5 * np.ones(6), DT)
    reference.advance(DT)
    np.testing.assert_allclose(reference.q, 1.0 + 0.5 * DT)
