"""The arbiter: a weighted mean that no vote can push over a limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from base.arbiter import Arbiter
from base.behaviour import STOP, Vote
from base.fusion import RULES

SPEED = np.array([1.2, 1.2, 1.2])
ACCELERATION = np.array([1.5, 1.5, 3.0])
JERK = np.array([8.0, 8.0, 16.0])


def settle(votes: dict[str, Vote], rule: str = "weighted") -> np.ndarray:
    """The command after five seconds of the same votes."""
    arbiter = Arbiter(SPEED, ACCELERATION, 0.05, JERK, rule)
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
unit = st.floats(-1, 1)
votes = st.builds(
    Vote,
    velocity=st.tuples(number, number, number).map(np.array),
    weight=st.floats(0, 1e6),
    bound=st.none() | st.tuples(number, number, number).map(np.array),
    limits=st.none()
    | st.lists(st.tuples(unit, unit, unit, st.floats(-0.1, 2)), max_size=4).map(
        lambda rows: np.array(rows).reshape(-1, 4)
    ),
)
script = st.lists(
    st.tuples(st.floats(-0.1, 0.5), st.dictionaries(st.sampled_from("abc"), votes)), max_size=30
)


@settings(max_examples=150, deadline=None)
@given(script=script, rule=st.sampled_from(sorted(RULES)))
def test_limits_are_never_exceeded(script: list[tuple[float, dict[str, Vote]]], rule: str) -> None:
    """Whatever is voted and whenever it is called: speed and acceleration stay within limits."""
    arbiter = Arbiter(SPEED, ACCELERATION, 0.05, JERK, rule)
    now, before = 0.0, np.zeros(3)
    for elapsed, ballot in script:
        now += elapsed
        chosen = arbiter.choose(now, ballot)
        assert np.isfinite(chosen).all()
        assert (np.abs(chosen) <= SPEED + 1e-12).all()
        assert (np.abs(chosen - before) <= ACCELERATION * 0.05 + 1e-12).all()
        before = chosen


@settings(max_examples=150, deadline=None)
@given(
    ballots=st.lists(st.dictionaries(st.sampled_from("abc"), votes), max_size=40),
    rule=st.sampled_from(sorted(RULES)),
)
def test_jerk_is_never_above_its_limit(ballots: list[dict[str, Vote]], rule: str) -> None:
    """At every timely call, stops and bounds that tighten included."""
    arbiter = Arbiter(SPEED, ACCELERATION, 0.05, JERK, rule)
    commands = [np.zeros(3), np.zeros(3)]
    commands += [arbiter.choose(0.05 * i, ballot) for i, ballot in enumerate(ballots)]
    jerk = np.diff(np.array(commands), n=2, axis=0) / 0.05**2
    assert (np.abs(jerk) <= JERK + 1e-6).all()


def test_the_optimum_slides_along_what_limits_and_the_mean_stops_there() -> None:
    """Driving slantwise at a wall, one goes on along it, the other goes no further."""
    wall = Vote(np.zeros(3), weight=0.0, limits=np.array([[1.0, 0.0, 0.0, 0.0]]))
    ballot = {"drive": vote(0.4, 0.3), "avoid": wall}
    np.testing.assert_allclose(settle(ballot, "optimum"), [0.0, 0.3, 0.0], atol=1e-6)
    np.testing.assert_allclose(settle(ballot, "weighted"), 0.0, atol=1e-6)


def test_the_optimum_is_where_the_weighted_squares_are_least() -> None:
    """No allowed neighbour is nearer to the votes on the whole."""
    ballot = {
        "a": vote(0.8, 0.5, 0.3),
        "b": vote(0.2, 0.9, -0.4, weight=2.0),
        "c": Vote(np.zeros(3), 0.0, limits=np.array([[0.6, 0.8, 0.1, 0.3], [0.0, 1, 0, 0.2]])),
    }

    def cost(u: np.ndarray) -> float:
        return sum(v.weight * float(np.sum((u - v.velocity) ** 2)) for v in ballot.values())

    best = settle(ballot, "optimum")
    rng = np.random.default_rng(1)
    rows = ballot["c"].limits
    assert rows is not None
    for near in best + 0.05 * rng.standard_normal((500, 3)):
        if (rows[:, :3] @ near <= rows[:, 3]).all():
            assert cost(near) >= cost(best) - 1e-6


def test_an_unknown_rule_is_refused_with_the_names_of_all() -> None:
    """The text says what there is."""
    with pytest.raises(ValueError, match="optimum, weighted"):
        Arbiter(SPEED, ACCELERATION, 0.05, rule="majority")


def test_the_plan_is_what_is_then_commanded() -> None:
    """With the same wish every step, the commands come as planned."""
    arbiter = Arbiter(SPEED, ACCELERATION, 0.05, JERK)
    ballot = {"a": vote(0.5, -0.2, 0.1)}
    arbiter.choose(0.0, ballot)
    plan = arbiter.plan([ballot["a"].velocity] * 6)
    then = [arbiter.choose(0.05 * i, ballot) for i in range(1, 7)]
    np.testing.assert_allclose(plan, then, atol=1e-12)


def test_time_that_stands_still_changes_nothing() -> None:
    """Two calls at the same instant, or one in the past, give the same command."""
    arbiter = Arbiter(SPEED, ACCELERATION, 0.05)
    first = arbiter.choose(1.0, {"a": vote(1.0)})
    assert first[0] == pytest.approx(0.02)
    np.testing.assert_array_equal(arbiter.choose(1.0, {"a": vote(-1.0)}), first)
    np.testing.assert_array_equal(arbiter.choose(0.5, {"a": vote(-1.0)}), first)
