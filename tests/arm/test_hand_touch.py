"""A load cell in a spherical tip tells where it touches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.hand.touch import contact_from_wrench, tare

R = 0.012
seeds = st.integers(0, 2**32 - 1)


def _contact(rng: np.random.Generator, push: float = 1.5) -> tuple[np.ndarray, np.ndarray, float]:
    """A unit normal out of the tip, a force on it with friction, and a spin moment."""
    n = rng.normal(size=3)
    n /= np.linalg.norm(n)
    slip = np.cross(n, rng.normal(size=3))
    f = -push * n + rng.uniform(0.0, 1.0) * push * slip / np.linalg.norm(slip)
    return n, f, rng.uniform(-1.0, 1.0) * 0.004 * push


@settings(deadline=None)
@given(seeds)
def test_exact_for_a_soft_finger(seed: int) -> None:
    """Point and normal are exact for any friction force and any spin."""
    n, f, spin = _contact(np.random.default_rng(seed))
    c, found = contact_from_wrench(f, np.cross(R * n, f) + spin * n, R)
    np.testing.assert_allclose(c, R * n, atol=1e-9)
    np.testing.assert_allclose(found, n, atol=1e-7)


@settings(deadline=None)
@given(seeds, st.floats(0.0, 3.0))
def test_normal_does_not_see_tangential_force(seed: int, friction: float) -> None:
    """Whatever drags on the tip along the surface, the normal is the same."""
    rng = np.random.default_rng(seed)
    n, _, _ = _contact(rng)
    drag = np.cross(n, rng.normal(size=3))
    f = -n + friction * drag / np.linalg.norm(drag)
    _, with_drag = contact_from_wrench(f, np.cross(R * n, f), R)
    np.testing.assert_allclose(with_drag, n, atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_wrench_is_explained(seed: int) -> None:
    """Any wrench, noise included, gives a point on the sphere; along with many it is the same."""
    rng = np.random.default_rng(seed)
    f, m = rng.normal(size=(20, 3)), 0.01 * rng.normal(size=(20, 3))
    c, n = contact_from_wrench(f, m, R)
    np.testing.assert_allclose(np.linalg.norm(c, axis=1), R, rtol=1e-9)
    for i in range(20):
        np.testing.assert_array_equal(contact_from_wrench(f[i], m[i], R)[1], n[i])


@pytest.mark.parametrize(("push", "most"), [(0.5, 0.08), (1.5, 0.03), (3.0, 0.014)])
def test_noise_costs_little(push: float, most: float) -> None:
    """0.02 N and 0.2 mN m cost at most 0.03 rad at 1.5 N."""
    rng = np.random.default_rng(1)
    n = np.array([0.36, 0.48, 0.8])
    f = -push * n
    m = np.cross(R * n, f)
    noise = rng.normal(size=(4000, 6)) * np.repeat([0.02, 2e-4], 3)
    _, found = contact_from_wrench(f + noise[:, :3], m + noise[:, 3:], R)
    spread = float(np.sqrt(np.mean(np.arccos(np.clip(found @ n, -1.0, 1.0)) ** 2)))
    assert spread < most


def test_tare_finds_bias_and_weight() -> None:
    """From a few postures bias, mass and centre of mass; then a contact is read in another."""
    rng = np.random.default_rng(2)
    g = rng.normal(size=(40, 3))
    g *= 9.81 / np.linalg.norm(g, axis=1, keepdims=True)
    mass, com, bias = 0.03, np.array([0.001, -0.002, 0.004]), rng.normal(size=6)
    weight = np.hstack([mass * g, np.cross(mass * com, g)])
    found = tare(weight + bias + 1e-4 * rng.normal(size=weight.shape), g)
    assert found.mass == pytest.approx(mass, rel=0.01)
    np.testing.assert_allclose(found.first_moment, mass * com, atol=1e-5)
    n, f, spin = _contact(rng)
    wrench = np.hstack([f, np.cross(R * n, f) + spin * n]) + bias
    down = np.array([9.81, 0.0, 0.0])
    wrench += np.hstack([mass * down, np.cross(mass * com, down)])
    assert contact_from_wrench(*found.net(wrench, down), R)[1] @ n > np.cos(0.03)


def test_tare_in_one_posture_takes_the_weight_along() -> None:
    """Without a change of gravity the weight is in the bias, and no mass is made up."""
    g = np.tile([0.0, 0.0, -9.81], (5, 1))
    found = tare(np.tile([0.1, 0.0, -0.3, 0.0, 0.0, 0.0], (5, 1)), g)
    assert found.mass == 0.0
    np.testing.assert_allclose(found.net([0.1, 0.0, -0.3, 0.0, 0.0, 0.0])[0], 0.0, atol=1e-12)


def test_what_is_no_contact_is_refused() -> None:
    """No force, no radius, no number."""
    with pytest.raises(ValueError, match="no contact"):
        contact_from_wrench(np.zeros(3), np.zeros(3), R)
    with pytest.raises(ValueError, match="positive"):
        contact_from_wrench(np.ones(3), np.zeros(3), 0.0)
    with pytest.raises(ValueError, match="finite"):
        contact_from_wrench([np.nan, 0.0, 0.0], np.zeros(3), R)
    with pytest.raises(ValueError, match="readings"):
        tare(np.zeros((0, 6)))
