"""The arbiter: a weighted mean that no vote can push over a limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from base.arbiter import Arbiter
from base.behaviour import STOP, Vote

SPEED = np.array([1.2, 1.2, 1.2])
ACCELERATION = np.array([1.5, 1.5, 3.0])


def settle(votes: dict[str, Vote]) -> np.ndarray:
    """The command after five seconds of the same votes."""
    arbiter = Arbiter(SPEED, ACCELERATION, 0.05)
    for i in range(100):
        chosen = arbiter.choose(0.05 * i, votes)
    return chosen


def vote(x: float, y: float = 0.0, turn: float = 0.0, weight: float = 1.0) -> Vote:
    """A vote without a bound."""
    return Vote(np.array([x, y, turn]), weight)


def test_choice_is_the_weighted_mean() -> None:
    """Votes count by their weight; one of weight 0 not at all."""
    chosen = settle({"a": vote(0.4), "b": vote(-0.2, weight=2.0), "c": vote(9.0, weight=0.0)})
    np.testing.assert_allclose(chosen, 0.0, atol=1e-12)


def test_no_votes_mean_zero() -> None:
    """With nobody wanting anything the platform comes to rest."""
    np.testing.assert_array_equal(settle({}), 0.0)


def test_a_bound_holds_whatever_the_others_want_and_keeps_the_direction() -> None:
    """A bound on vy slows vx with it, so that the course stays; the turn is bounded by itself."""
    bound = Vote(np.zeros(3), weight=0.0, bound=np.array([1.0, 0.1, 0.2]))
    np.testing.assert_allclose(settle({"a": vote(0.4, 0.2, 1.0), "b": bound}), [0.2, 0.1, 0.2])


def test_stop_outweighs_everything() -> None:
    """The stop vote brings the command to exactly zero."""
    np.testing.assert_array_equal(settle({"a": vote(1.0, weight=1e9), "stop": STOP}), 0.0)


number = st.floats(-1e6, 1e6)
votes = st.builds(
    Vote,
    velocity=st.tuples(number, number, number).map(np.array),
    weight=st.floats(0, 1e6),
    bound=st.none() | st.tuples(number, number, number).map(np.array),
)
script = st.lists(
    st.tuples(st.floats(-0.1, 0.5), st.dictionaries(st.sampled_from("abc"), votes)), max_size=30
)


@settings(max_examples=150, deadline=None)
@given(script=script)
def test_limits_are_never_exceeded(script: list[tuple[float, dict[str, Vote]]]) -> None:
    """Whatever is voted and whenever it is called: speed and acceleration stay within limits."""
    arbiter = Arbiter(SPEED, ACCELERATION, 0.05)
    now, before = 0.0, np.zeros(3)
    for elapsed, ballot in script:
        now += elapsed
        chosen = arbiter.choose(now, ballot)
        assert np.isfinite(chosen).all()
        assert (np.abs(chosen) <= SPEED + 1e-12).all()
        assert (np.abs(chosen - before) <= ACCELERATION * 0.05 + 1e-12).all()
        before = chosen


def test_time_that_stands_still_changes_nothing() -> None:
    """Two calls at the same instant, or one in the past, give the same command."""
    arbiter = Arbiter(SPEED, ACCELERATION, 0.05)
    first = arbiter.choose(1.0, {"a": vote(1.0)})
    assert first[0] == pytest.approx(0.075)
    np.testing.assert_array_equal(arbiter.choose(1.0, {"a": vote(-1.0)}), first)
    np.testing.assert_array_equal(arbiter.choose(0.5, {"a": vote(-1.0)}), first)
