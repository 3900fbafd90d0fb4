"""The control basis as an algebra, and the objectives that serve arms, bases and hands alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.control import (
    Composable,
    Force,
    Line,
    Moment,
    Objective,
    Posture,
    Rows,
    Singularity,
    chain,
    joint_limits,
    parallelised,
)
from arm.control.priority import SINGULAR, priorities, projector, solve
from arm.control.singularity import manipulability, manipulability_gradient
from arm.model import STANDING, ArmModel, Kinematics
from services.messages import Array

DOFS = st.sampled_from([3, 6, 10, 16])
SEEDS = st.integers(0, 10_000)


def kinematics(dof: int, rng: np.random.Generator) -> Kinematics:
    """Of some robot with so many joints."""
    J = rng.standard_normal((6, dof))
    return Kinematics(np.zeros(3), np.eye(3), J, np.zeros(6), np.zeros(dof))


class Wants(Objective):
    """Asks for a rate along rows of its own."""

    def __init__(self, name: str, J: Array, rate: Array) -> None:
        self.name, self.J, self.rate = name, J, rate

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        return Rows(self.J, self.rate)


def wants(rng: np.random.Generator, count: int, dof: int, most: int = 3) -> list[Objective]:
    """Objectives of random rows; together they may ask for more than there are joints."""
    sizes = rng.integers(1, most + 1, count)
    return [
        Wants("abcdefg"[i], rng.standard_normal((m, dof)), rng.uniform(-1, 1, m))
        for i, m in enumerate(sizes.tolist())
    ]


def rows_of(objectives: tuple[Objective, ...], dof: int) -> list[Rows]:
    """What each asks for in some posture."""
    here = kinematics(dof, np.random.default_rng(0))
    return [o.rows(here, 0.001) for o in objectives]


# --- the algebra ----------------------------------------------------------------------------


def named(name: str) -> Objective:
    """An objective that is only a name."""
    return Wants(name, np.zeros((1, 3)), np.zeros(1))


def test_derivation_of_the_parallelised_controller_reads_as_in_the_paper() -> None:
    """Platt et al., Eq 8 to 11, from the definitions of their Eq 6 and 7."""
    m, f, reach = named("m"), named("f"), named("reach")
    gm = f.subject_to(reach).called("gm")
    comply = m.subject_to(f).subject_to(reach).called("comply")
    whole = parallelised([reach, gm, comply])
    assert whole.derivation() == [  # type: ignore[attr-defined]
        "comply / gm / reach",
        "m / f / reach / (f / reach) / reach",
        "m / f / reach / f / reach / reach",
        "m / f / reach",
    ]
    assert str(whole.simplified()) == "m / f / reach"
    assert whole.parts() == (reach, f, m)


def test_composites_print_as_they_were_written() -> None:
    """Only a composite to the right of a slash needs parentheses."""
    a, b, c = named("a"), named("b"), named("c")
    assert str(a.subject_to(b).subject_to(c)) == str(a / b / c) == "a / b / c"
    assert str(a / (b / c)) == "a / (b / c)"
    assert (a / (b / c)).parts() == (a / b / c).parts() == (c, b, a)


@given(SEEDS, DOFS, st.lists(st.integers(0, 4), min_size=2, max_size=9))
@settings(deadline=None, max_examples=60, derandomize=True)
def test_simplification_keeps_the_evaluated_controller(
    seed: int, dof: int, indices: list[int]
) -> None:
    """Written out with its repetitions or simplified, a composite moves the joints alike."""
    pool = wants(np.random.default_rng(seed), 5, dof, most=2)
    whole: Composable = pool[indices[0]]
    for i in indices[1:]:
        whole = whole.subject_to(pool[i])
    rows = rows_of(whole.occurrences(), dof)
    # damping, where the rows run out, is no part of the algebra
    used = 0
    for part in whole.parts():
        used += len(part.rows(kinematics(dof, np.random.default_rng(0)), 0.001).rate)
    if used <= dof and priorities(rows, dof).manipulability > SINGULAR:
        simple = solve(rows_of(whole.simplified().parts(), dof), dof)
        np.testing.assert_allclose(solve(rows, dof), simple, atol=1e-7)


# --- null spaces, any number of joints ------------------------------------------------------


@given(SEEDS, DOFS, st.integers(1, 4))
@settings(deadline=None, max_examples=60, derandomize=True)
def test_projector_is_symmetric_idempotent_and_blind_to_what_is_above(
    seed: int, dof: int, count: int
) -> None:
    """N = N', N N = N, A N = 0, and its trace is the number of joints left."""
    rows = rows_of(tuple(wants(np.random.default_rng(seed), count, dof, most=1)), dof)
    N = projector(rows, dof)
    np.testing.assert_allclose(N, N.T, atol=1e-9)
    np.testing.assert_allclose(N @ N, N, atol=1e-9)
    for row in rows:
        np.testing.assert_allclose(row.J @ N, 0.0, atol=1e-9)
    assert np.trace(N) == pytest.approx(max(dof - count, 0))


def test_projector_leaves_out_what_is_in_its_goal_region() -> None:
    """With every goal reached it is the identity (Platt et al., below Eq 4)."""
    J = np.random.default_rng(4).standard_normal((2, 6))
    done = Rows(J, np.zeros(2), 0.0)
    np.testing.assert_array_equal(projector([done], 6), np.eye(6))
    assert np.linalg.matrix_rank(projector([done, Rows(J, np.zeros(2))], 6)) == 4


@given(SEEDS, DOFS, st.integers(2, 5))
@settings(deadline=None, max_examples=80, derandomize=True)
def test_lower_objectives_never_move_higher_ones(seed: int, dof: int, count: int) -> None:
    """However many are below, and even if they ask for the impossible: to rounding, not at all."""
    rows = rows_of(tuple(wants(np.random.default_rng(seed), count, dof)), dof)
    alone = [solve(rows[: k + 1], dof) for k in range(count)]
    together = solve(rows, dof)
    used = 0
    for k, row in enumerate(rows):
        used += len(row.rate)
        well = priorities(rows[: k + 1], dof).manipulability > SINGULAR
        if used <= dof and well:  # the damped ones are not met, and may be moved
            np.testing.assert_allclose(row.J @ together, row.J @ alone[k], atol=1e-6)
            np.testing.assert_allclose(row.J @ together, row.rate, atol=1e-6)


@given(SEEDS)
@settings(deadline=None, max_examples=40, derandomize=True)
def test_solving_at_once_is_solving_level_by_level(seed: int) -> None:
    """The short cut for as many rows as joints changes nothing."""
    rng = np.random.default_rng(seed)
    rows = rows_of(tuple(wants(rng, 1, 6, most=1)), 6)
    left = 6 - sum(len(r.rate) for r in rows)
    rows.append(Rows(rng.standard_normal((left, 6)), rng.uniform(-1, 1, left)))
    long_way = [*rows, Rows(np.zeros((1, 6)), np.zeros(1))]  # one row more: level by level
    if priorities(rows, 6).manipulability > SINGULAR:
        np.testing.assert_allclose(solve(rows, 6), solve(long_way, 6), atol=1e-8)


def test_order_of_orthogonal_terms_does_not_matter() -> None:
    """Equals among equals: joint limits in any order hold the joints alike."""
    lower, upper = np.full(7, -1.0), np.full(7, 1.0)
    q = np.array([0.95, -0.97, 0.0, 0.9, -0.2, 1.02, -0.93])
    here = replace(kinematics(7, np.random.default_rng(1)), q=q)
    parts = joint_limits(lower, upper).parts()
    forward = solve([p.rows(here, 0.001) for p in parts], 7)
    backward = solve([p.rows(here, 0.001) for p in reversed(parts)], 7)
    np.testing.assert_allclose(forward, backward, atol=1e-12)
    assert (np.sign(forward) == [-1, 1, 0, -1, 0, -1, 1]).all()


# --- objectives -----------------------------------------------------------------------------


def reaching(model: ArmModel, q: Array, composite: Composable, ticks: int = 2000) -> Kinematics:
    """Follow a composite kinematically from ``q``."""
    here = model.place(STANDING, q, np.zeros(6))
    for _ in range(ticks):
        qd = solve([part.rows(here, 0.001) for part in composite.parts()], 6)
        here = model.place(STANDING, here.q + 0.001 * qd, qd)
    return here


@pytest.fixture(scope="module")
def model() -> ArmModel:
    """The arm."""
    return ArmModel("xr4000_puma560")


def test_line_is_reached_anywhere_along_it(model: ArmModel) -> None:
    """The tip ends on the line; a posture subject to it may still slide along the line."""
    rest = np.array(model.robot.arm.rest)
    here = model.place(STANDING, rest, np.zeros(6))
    line = Line(np.array([0.0, 2.0, 0.0]), tolerance=0.0)
    line.through(here.p + np.array([-0.05, 0.3, 0.04]))
    end = reaching(model, rest, line)
    assert np.linalg.norm(line.error(end)) < 1e-6
    assert abs(end.p[1] - here.p[1]) < 0.1  # not pulled to the point that defines it
    slid = reaching(model, rest, Posture(rest + 0.2, gain=2.0).subject_to(line))
    assert np.linalg.norm(line.error(slid)) < 1e-4
    assert abs(slid.p[1] - end.p[1]) > 0.02
    with pytest.raises(ValueError, match="direction"):
        Line(np.zeros(3))


def test_moment_turns_the_tool_and_leaves_the_force_alone() -> None:
    """Comply: the moment asks for a turn, in the null space of the force."""
    here = kinematics(10, np.random.default_rng(3))
    force = Force(np.array([1.0, 0, 0]), gain=0.02)
    force.begin(1.0, 0.0)
    force.press(1.5, 1.0)
    moment = Moment(np.eye(3)[:2], gain=1.0, acceleration=1e9)
    moment.feel(np.array([0.3, -0.2, 5.0]))
    rows = [p.rows(here, 0.001) for p in moment.subject_to(force).parts()]
    qd = solve(rows, 10)
    np.testing.assert_allclose(rows[0].J @ qd, rows[0].rate, atol=1e-9)
    np.testing.assert_allclose(here.J[3:5] @ qd, [-0.3, 0.2], atol=1e-9)


def test_manipulability_gradient_agrees_with_differences(model: ArmModel) -> None:
    """The closed form against central differences of the model's own Jacobian."""
    q = np.array(model.robot.arm.rest)

    def w(at: Array) -> float:
        return manipulability(model.place(STANDING, at, np.zeros(6)).J)

    gradient = manipulability_gradient(model.place(STANDING, q, np.zeros(6)).J)
    h = 1e-6 * np.eye(6)
    differences = [(w(q + e) - w(q - e)) / 2e-6 for e in h]
    np.testing.assert_allclose(gradient, differences, atol=1e-6)


def test_singularity_avoidance_leaves_a_straight_wrist(model: ArmModel) -> None:
    """It raises the manipulability to where its goal region begins, without moving the tip."""
    rest = np.array(model.robot.arm.rest)
    bent = rest.copy()
    bent[4] = 0.05
    here = model.place(STANDING, bent, np.zeros(6))
    before = manipulability(here.J)
    enough = 4.0 * before
    # the gradient of a product is small where it is needed: the gain makes up for it
    avoid = Singularity(enough, gain=4.0)
    line = Line(here.R[:, 2])
    line.through(here.p)
    end = reaching(model, bent, avoid.subject_to(line))
    assert manipulability(end.J) > 2.0 * before
    assert np.linalg.norm(line.error(end)) < 1e-4


def test_joint_limits_hold_a_joint_back_from_what_is_subject_to_them(model: ArmModel) -> None:
    """A posture beyond a limit is approached, and the limit not reached."""
    rest = np.array(model.robot.arm.rest)
    limits = joint_limits(model.q_lower, model.q_upper)
    target = rest.copy()
    target[4] = model.q_upper[4] + 0.3
    pulled = Posture(target, gain=2.0)
    assert reaching(model, rest, pulled).q[4] > model.q_upper[4]
    held = reaching(model, rest, pulled.subject_to(limits))
    assert model.q_upper[4] - 0.15 < held.q[4] < model.q_upper[4] - 0.02
    assert str(pulled.subject_to(limits)) == "posture / limits"


def test_objectives_of_several_control_points_share_the_joints() -> None:
    """Two palms on one base: each line is served, through the Jacobian of its own palm."""
    rng = np.random.default_rng(5)
    palms = {side: kinematics(12, rng) for side in ("left", "right")}
    lines = []
    for side in palms:
        line = Line(rng.standard_normal(3))
        line.through(rng.uniform(-0.1, 0.1, 3))
        lines.append((side, line))
    objectives = tuple(line.at(lambda whole, s=side: whole[s]) for side, line in lines)
    rows = [o.rows(palms, 0.001) for o in chain(objectives).parts()]  # type: ignore[arg-type]
    qd = solve(rows, 12)
    for side, line in lines:
        want = line.gain * line.error(palms[side])
        np.testing.assert_allclose(line.jacobian(palms[side]) @ qd, want, atol=1e-9)
