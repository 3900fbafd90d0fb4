"""Joints kept within the rates they may have; what is lowest in priority gives way first."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.control import Rows
from arm.control.priority import priorities
from arm.control.within import priorities_within


def rows(seed: int) -> list[Rows]:
    """A position and an orientation for six joints, both asking for something."""
    rng = np.random.default_rng(seed)
    return [Rows(rng.normal(size=(3, 6)), 0.3 * rng.normal(size=3)) for _ in range(2)]


@given(st.integers(0, 10_000), st.floats(0.05, 2.0))
@settings(deadline=None, max_examples=200, derandomize=True)
def test_no_joint_leaves_its_rates_however_little_they_are(seed: int, bound: float) -> None:
    """Not even where no joint is left to serve anything."""
    ends = np.full(6, bound) * np.random.default_rng(seed).uniform(0.2, 1.0, 6)
    solution, held = priorities_within(rows(seed), -ends, ends)
    assert (np.abs(solution.qd) <= ends + 1e-6).all()
    assert len(set(held)) == len(held)


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=50, derandomize=True)
def test_rates_that_are_free_are_those_of_the_priorities(seed: int) -> None:
    """Bit for bit, and no joint is held."""
    free = np.full(6, np.inf)
    solution, held = priorities_within(rows(seed), -free, free)
    assert not held
    np.testing.assert_array_equal(solution.qd, priorities(rows(seed), 6).qd)


def test_the_last_priority_gives_way_for_a_held_joint_and_the_first_does_not() -> None:
    """By one joint held, of six that serve two objectives of three rows."""
    for seed in range(20):
        asked = rows(seed)
        plain = priorities(asked, 6).qd
        joint = int(np.abs(plain).argmax())
        lowest, highest = np.full(6, -np.inf), np.full(6, np.inf)
        lowest[joint], highest[joint] = sorted((0.0, 0.5 * plain[joint]))
        solution, held = priorities_within(asked, lowest, highest)
        assert held == [joint]
        np.testing.assert_allclose(asked[0].J @ solution.qd, asked[0].rate, atol=5e-3)
        assert np.linalg.norm(asked[1].J @ solution.qd - asked[1].rate) > 0.01
