"""The control basis: composition, priority, damping, goal regions, admittance, filter."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.control import (
    Composable,
    ContactObserver,
    Force,
    LowPass,
    Objective,
    Orientation,
    Position,
    Posture,
)
from arm.control.motion import edge
from arm.control.objective import Rows
from arm.control.priority import solve
from arm.model import Kinematics
from services.messages import Array

HERE = Kinematics(np.zeros(3), np.eye(3), np.eye(6), np.zeros(6), np.zeros(6))


class Named(Objective):
    """An objective that is only a name."""

    def __init__(self, name: str) -> None:
        self.name = name


def names(composite: Composable) -> str:
    """As the papers write it: lowest priority first."""
    return "/".join(part.name for part in reversed(composite.parts()))  # type: ignore[attr-defined]


def random_rows(rng: np.random.Generator, sizes: list[int], dof: int) -> list[Rows]:
    """Well-conditioned levels: rows of a random orthogonal matrix times a mild random one."""
    Q = np.linalg.qr(rng.standard_normal((dof, dof)))[0]
    out, at = [], 0
    for m in sizes:
        mix = np.eye(m) + 0.3 * rng.uniform(-1, 1, (m, m)) / m
        J = mix @ Q[at : at + m] + 0.3 * rng.standard_normal((m, at)) @ Q[:at]
        out.append(Rows(rng.uniform(0.2, 3) * J, rng.uniform(-1, 1, m)))
        at += m
    return out


# --- composition ----------------------------------------------------------------------------


def test_papers_algebra_is_reproduced() -> None:
    """Comply / gm / reach becomes m / f / reach (Platt, Eq 8 to 11)."""
    m, f, reach = Named("m"), Named("f"), Named("reach")
    gm = f.subject_to(reach)
    comply = m.subject_to(f).subject_to(reach)
    assert names(comply.subject_to(gm).subject_to(reach)) == "m/f/reach"
    assert names(comply.subject_to(gm.subject_to(reach))) == "m/f/reach"


def test_duplicate_counts_at_its_higher_priority() -> None:
    """Of two occurrences the right-most is kept: a / b / a is b / a."""
    a, b = Named("a"), Named("b")
    assert names(a.subject_to(b).subject_to(a)) == "b/a"


@given(st.lists(st.integers(0, 4), min_size=3, max_size=7), st.data())
@settings(deadline=None, max_examples=60, derandomize=True)
def test_composition_is_associative(indices: list[int], data: st.DataObject) -> None:
    """Any bracketing of the same sequence gives the same priorities."""
    pool = [Named(str(i)) for i in range(5)]
    sequence: list[Composable] = [pool[i] for i in indices]
    left = sequence[0]
    for item in sequence[1:]:
        left = left.subject_to(item)
    bracketed = list(sequence)
    while len(bracketed) > 1:
        at = data.draw(st.integers(0, len(bracketed) - 2))
        bracketed[at : at + 2] = [bracketed[at].subject_to(bracketed[at + 1])]
    assert names(bracketed[0]) == names(left)


# --- priority -------------------------------------------------------------------------------


@given(
    st.integers(0, 10_000),
    st.sampled_from([[3, 3], [2, 1, 3], [1, 2, 2], [1, 1, 1, 1, 1, 1], [4, 2], [3, 2]]),
)
@settings(deadline=None, max_examples=80, derandomize=True)
def test_lower_objective_never_moves_a_higher_one(seed: int, sizes: list[int]) -> None:
    """With and without the levels below, each level gets exactly the rate it asked for."""
    levels = random_rows(np.random.default_rng(seed), sizes, 6)
    qd = solve(levels, 6)
    for level in levels:
        np.testing.assert_allclose(level.J @ qd, level.rate, atol=1e-9)


@given(st.integers(0, 10_000), st.integers(1, 4))
@settings(deadline=None, max_examples=60, derandomize=True)
def test_conflicting_objective_gives_way(seed: int, m: int) -> None:
    """An objective that wants the opposite of a higher one changes nothing."""
    rng = np.random.default_rng(seed)
    first = random_rows(rng, [m], 6)[0]
    mix = np.eye(m) + 0.3 * rng.uniform(-1, 1, (m, m)) / m
    opposite = Rows(mix @ first.J, rng.uniform(-5, 5, m))
    np.testing.assert_allclose(solve([first, opposite], 6), solve([first], 6), atol=1e-9)


def test_redundant_objective_takes_no_freedom_from_those_below() -> None:
    """Two objectives that ask for the same leave three directions to a third one."""
    rng = np.random.default_rng(3)
    first, last = random_rows(rng, [3, 3], 6)
    same = Rows(first.J.copy(), first.rate.copy())
    np.testing.assert_allclose(solve([first, same, last], 6), solve([first, last], 6), atol=1e-9)


def test_projector_is_idempotent_and_symmetric() -> None:
    """What is left to a last full objective is N qd, with N N = N = N' and rank 6 - m."""
    rng = np.random.default_rng(8)
    upper = [Rows(r.J, np.zeros(len(r.rate))) for r in random_rows(rng, [2, 1], 6)]
    N = np.column_stack([solve([*upper, Rows(np.eye(6), e)], 6) for e in np.eye(6)])
    # the last level is damped: the projected identity has lost rank
    scale = np.trace(N) / 3.0
    assert 0.5 < scale <= 1.0 + 1e-9
    np.testing.assert_allclose(N, N.T, atol=1e-9)
    np.testing.assert_allclose(N @ N, scale * N, atol=1e-9)
    for row in upper:
        np.testing.assert_allclose(row.J @ N, 0.0, atol=1e-9)


@pytest.mark.parametrize("small", [0.0, 1e-6, 1e-4, 1e-3, 1e-2])
def test_damping_bounds_rates_near_a_singularity(small: float) -> None:
    """Rows that grow parallel never ask for more than 60 times the rate."""
    a, b = np.eye(6)[0], np.eye(6)[1]
    J = np.array([a, a + small * b])
    assert np.abs(solve([Rows(J, np.array([1.0, -1.0]))], 6)).max() < 60.0


@pytest.mark.parametrize("small", [1e-8, 1e-6, 1e-4, 1e-3, 1e-2])
def test_damping_bounds_rates_when_priority_takes_nearly_all(small: float) -> None:
    """A lower objective nearly parallel to a higher one never asks for more than 60 times."""
    a, b = np.eye(6)[0], np.eye(6)[1]
    levels = [Rows(a[None], np.array([1.0])), Rows((a + small * b)[None], np.array([-1.0]))]
    qd = solve(levels, 6)
    assert np.abs(qd).max() < 120.0  # the error is 2
    assert qd[0] == pytest.approx(1.0)


def test_rates_are_continuous_where_damping_sets_in() -> None:
    """Passing a singularity never makes the rates jump."""
    a, b = np.eye(6)[0], np.eye(6)[1]
    angles = np.linspace(-0.1, 0.1, 20_001)
    qd = np.array(
        [
            solve([Rows(np.array([a, math.cos(x) * a + math.sin(x) * b]), np.array([1, 0.9]))], 6)
            for x in angles[::10]
        ]
    )
    assert np.abs(np.diff(qd, axis=0)).max() < 0.5


# --- goal regions ---------------------------------------------------------------------------


def test_edge_of_a_goal_region_is_smooth() -> None:
    """0 well inside, 1 outside, monotonic, without a jump or a kink between."""
    x = np.linspace(0.0, 2.0, 2001)
    y = np.array([edge(np.array([e]), 1.0) for e in x])
    assert y[x <= 0.5].max() == 0.0
    assert y[x >= 1.0].min() == 1.0
    slope = np.diff(y) / np.diff(x)
    assert slope.min() >= 0.0
    assert np.abs(np.diff(slope)).max() < 0.05
    assert edge(np.zeros(3), 0.0) == 1.0


def test_objective_in_its_goal_region_gives_its_freedom_away() -> None:
    """A satisfied position leaves all joints to what is below; an unsatisfied one does not."""
    below = Rows(np.eye(6), np.ones(6))
    near, far = Position(np.eye(3), tolerance=0.01), Position(np.eye(3), tolerance=0.01)
    near.track(np.array([0.004, 0, 0]), np.zeros(3))
    far.track(np.array([0.02, 0, 0]), np.zeros(3))
    np.testing.assert_allclose(solve([near.rows(HERE, 0.001), below], 6), np.ones(6))
    got = solve([far.rows(HERE, 0.001), below], 6)
    np.testing.assert_allclose(got[:3], [8.0 * 0.02, 0.0, 0.0], atol=1e-9)


def test_orientation_turns_towards_its_target() -> None:
    """The rate is along the axis of the rotation still to go, whatever the angle below 90 deg."""
    for angle in (0.1, 1.0, 1.5):
        c, s = math.cos(angle), math.sin(angle)
        target = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        rate = Orientation(target, gain=2.0).rows(HERE, 0.001).rate
        np.testing.assert_allclose(rate, [0, 0, 2.0 * s], atol=1e-12)


# --- force ----------------------------------------------------------------------------------


def pressed(force: Force, measured: float, ticks: int) -> Array:
    """Speeds asked for along the direction, tick by tick."""
    out = []
    for _ in range(ticks):
        force.press(1.5, measured)
        out.append(float(force.rows(HERE, 0.001).rate[0]))
    return np.array(out)


def test_force_reference_ramps_from_what_is_felt() -> None:
    """At take-over nothing is asked for; the reference then rises at the ramp and ends at it."""
    force = Force(np.array([1.0, 0, 0]), gain=0.02, ramp=4.0)
    force.begin(0.5, 0.0)
    speeds = pressed(force, 0.5, 1)
    assert abs(speeds[0]) <= 0.02 * 4.0 * 0.001 + 1e-12
    pressed(force, 0.5, 124)
    assert force.reference == pytest.approx(0.5 + 4.0 * 0.125)
    pressed(force, 0.5, 200)
    assert force.reference == pytest.approx(1.5)


def test_force_speed_is_an_admittance_with_bounded_acceleration() -> None:
    """Speed goes to gain times error, and never changes faster than the bound."""
    force = Force(np.array([0, 0, 1.0]), gain=0.02, acceleration=0.5)
    force.begin(0.0, 0.01)
    speeds = pressed(force, 0.0, 2000)
    assert np.abs(np.diff(np.concatenate([[0.01], speeds]))).max() <= 0.5 * 0.001 + 1e-12
    assert speeds[-1] == pytest.approx(0.02 * 1.5)
    sudden = pressed(force, 50.0, 200)  # a shock
    assert np.abs(np.diff(sudden)).max() <= 0.5 * 0.001 + 1e-12
    assert sudden[-1] < 0.0


def test_force_takes_out_what_the_platform_does() -> None:
    """On a platform that drives at the board the joints give way by as much."""
    moving = replace(HERE, drift=np.array([0.3, 0, 0, 0, 0, 0]))
    force = Force(np.array([1.0, 0, 0]), gain=0.02)
    force.begin(1.5, 0.0)
    force.press(1.5, 1.5)
    assert force.rows(moving, 0.001).rate[0] == pytest.approx(-0.3)


def test_low_pass_halves_the_power_twice_at_its_cutoff() -> None:
    """Two first-order stages: gain 1/2 at the cut-off, 1 far below, starts without a transient."""
    fast, slow = LowPass(20.0), LowPass(20.0)
    t = np.arange(4000) * 0.001
    at = np.array([fast.step(math.sin(2 * math.pi * 20.0 * x), 0.001) for x in t])
    below = np.array([slow.step(math.sin(2 * math.pi * 0.5 * x), 0.001) for x in t])
    assert np.abs(at[2000:]).max() == pytest.approx(0.5, rel=0.1)
    assert np.abs(below[2000:]).max() == pytest.approx(1.0, rel=0.01)
    assert LowPass(5.0).step(3.0, 0.001) == 3.0
    assert LowPass(math.inf).step(7.0, 0.001) == 7.0


def test_posture_uses_only_the_freedom_that_is_left() -> None:
    """It draws every free joint to its target, and none that a higher objective needs."""
    position = Position(np.eye(3))
    position.track(np.zeros(3), np.zeros(3))
    bent = replace(HERE, q=np.full(6, 0.5))
    composite = Posture(np.zeros(6), gain=2.0).subject_to(position)
    qd = solve([part.rows(bent, 0.001) for part in composite.parts()], 6)
    np.testing.assert_allclose(qd[:3], 0.0, atol=1e-12)
    # what is left of six rows is of rank three, and damped for it
    np.testing.assert_allclose(qd[3:], -1.0, rtol=5e-3)


# --- contact --------------------------------------------------------------------------------


def spring(observer: ContactObserver | None, drift: float, seconds: float = 1.0) -> Array:
    """Force errors of a tool of 800 N/m on a surface that comes towards it at ``drift`` [m/s]."""
    force = Force(np.array([1.0, 0, 0]), gain=0.02, observer=observer)
    force.begin(1.5, 0.0)
    felt, out = 1.5, []
    for _ in range(round(seconds / 0.001)):
        force.press(1.5, felt)
        speed = float(force.rows(HERE, 0.001).rate[0])
        felt = max(felt + 800.0 * (speed + drift) * 0.001, 0.0)
        out.append(felt - 1.5)
    return np.array(out)


def test_contact_observer_takes_out_a_surface_that_comes_nearer() -> None:
    """A drift of 10 mm/s costs 0.5 N without it; with it a short peak, and nothing in the end."""
    assert spring(None, 0.01)[-1] == pytest.approx(0.5, rel=0.05)
    error = spring(ContactObserver(800.0, 20.0), 0.01)
    assert np.abs(error).max() < 0.25
    assert abs(error[-1]) < 1e-3


def test_contact_observer_bears_a_wrong_stiffness() -> None:
    """Believed half or twice as stiff as it is, the contact stays stable and the error goes."""
    for believed in (400.0, 1600.0):
        error = spring(ContactObserver(believed, 20.0), 0.01, 2.0)
        assert np.abs(error).max() < 0.4
        assert np.abs(error[-200:]).max() < 5e-3


def test_contact_observer_learns_nothing_in_the_air() -> None:
    """Without contact there is no surface whose drift could be known."""
    observer = ContactObserver(800.0, 20.0)
    observer.begin(0.0)
    for _ in range(500):
        observer.step(0.02, -0.05, 0.001)
    assert observer.drift == 0.0 and observer.force < 0.1
