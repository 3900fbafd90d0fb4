"""The hand's own ways: where it reaches, what it squeezes with, how it slides and gives up."""

from __future__ import annotations

import numpy as np
import pytest

from arm.hand.feel import Feel
from arm.hand.law import Law
from arm.hand.model import HandModel
from arm.hand.plan import THREE
from arm.hand.reaching import DEPTH, Guess, Path, across, look, opened, solve
from arm.hand.sliding import PERIOD, SINGLE, Slider, Way
from arm.hand.squeeze import internal
from arm.hand.ways import FLOOR, _room, elsewhere

UP = np.array([0.0, 0.0, 1.0])
GUESS = Guess(np.array([0.5, 0.0, 0.63]), UP)


@pytest.fixture(scope="module")
def model() -> HandModel:
    """The hand as believed."""
    return HandModel("platform_hand")


@pytest.mark.parametrize("pair", [False, True])
def test_a_squeeze_pushes_nothing(pair: bool) -> None:
    """Forces and moments of a grip cancel, wherever the tips are."""
    x = np.random.default_rng(3).normal(size=(3, 3))
    f = internal(x, pair)
    assert np.abs(f.sum(axis=0)).max() < 1e-12
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < 1e-12


def test_the_palm_looks_at_the_point_from_the_tilt_asked_for() -> None:
    """The palm is a rotation away from the axis by the tilt, DEPTH before the point."""
    for tilt in (0.0, 0.7, 1.4):
        R, p = look(GUESS, tilt, 0.4, 1.1)
        assert np.allclose(R.T @ R, np.eye(3))
        assert np.linalg.det(R) == pytest.approx(1.0)
        assert np.allclose(p + DEPTH * R[:, 2], GUESS.point)
        assert np.arccos(min(1.0, -R[2, 2])) == pytest.approx(tilt, abs=1e-6)


def test_a_level_hand_looks_across_a_line() -> None:
    """What the last reach learned is the line between finger 0 and the pair."""
    line = np.array([0.3, -0.9, 0.2])
    R, _ = look(GUESS, 1.0, across(GUESS, line), np.pi / 2)
    flat = line * [1.0, 1.0, 0.0]
    assert abs(R[:, 0] @ flat) / np.linalg.norm(flat) == pytest.approx(1.0, abs=1e-6)


def test_reaches_within_the_joints_limits_put_the_palm_where_it_should_be(
    model: HandModel,
) -> None:
    """And what is out of reach has no solution."""
    rng = np.random.default_rng(0)
    R, p = look(GUESS, 0.4, 0.2, 0.3)
    arm = solve(model, R, p, rng)
    assert arm is not None
    R_now, p_now, _ = model.palm_at(opened(arm, 1.05, 0.65))
    assert np.abs(p_now - p).max() < 1e-3
    assert np.abs(R_now - R).max() < 1e-3
    assert (arm > model.lower[:7]).all() and (arm < model.upper[:7]).all()
    assert solve(model, R, p + [2.0, 0.0, 0.0], rng) is None


def test_a_path_begins_and_ends_at_rest() -> None:
    """Each leg starts and stops slowly and meets its waypoint."""
    a, b = np.zeros(11), np.linspace(0.1, 1.0, 11)
    path = Path([a, b, a])
    rates = np.array([path.at(t)[1] for t in np.linspace(0.0, path.duration, 400)])
    assert np.abs(rates[[0, -1]]).max() < 1e-6
    assert np.abs(path.at(path.duration / 2 - 1e-9)[0] - b).max() < 1e-6


def test_forces_map_with_the_leaders_columns_and_motions_with_the_followers_too(
    model: HandModel,
) -> None:
    """A follower's gear does not let its load back: the two Jacobians differ, at coupled joints."""
    q = opened(np.array(model.robot.arm.rest), 1.0, 0.9)
    at = model.place(q, np.zeros(11))
    step = 1e-6
    for joint in range(11):
        moved = q.copy()
        moved[joint] += step
        x = model.place(moved, np.zeros(11)).x
        assert np.abs((x - at.x) / step - at.JS[:, :, joint]).max() < 1e-4
    assert np.allclose(at.JS[:, :, :7], at.JL[:, :, :7])
    assert np.abs(at.JS - at.JL)[:, :, 7:].max() > 0.01
    assert np.allclose(at.JL[2, :, 7], 0.0)  # finger 2 follows in spread: it loads no drive


def test_a_slider_without_progress_is_stuck_and_says_so() -> None:
    """Three parallel normals never balance."""
    normals = np.array([UP, UP, UP])
    points = np.eye(3) * 0.05
    slider = Slider(Way(plateau=0.5), points)
    for _ in range(25):
        assert not slider.stuck
        slider.update(normals, points, points)
    slider.update(normals, points, points)
    assert slider.stuck and not slider.converged


def test_what_leaves_its_goal_region_while_it_settles_has_not_converged() -> None:
    """Residuals that rise again are descended again, and settling begins anew."""
    turn = 2.0 * np.pi / 3.0 * np.arange(3)
    points = 0.05 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(3)])
    balanced, tipped = -points / 0.05, np.array([UP, UP, UP])
    way = Way()
    slider = Slider(way, points)
    for _ in range(way.times + 10):
        slider.update(balanced, points, points)
    assert slider.converged and (slider.updates, slider.settled) == (way.times, 10)
    slider.update(tipped, points, points)
    assert not slider.converged and slider.settled == 0
    for _ in range(way.times + 3):
        slider.update(balanced, points, points)
    assert slider.converged and (slider.updates, slider.settled) == (2 * way.times + 11, 3)


def test_references_stay_on_their_leash_and_on_the_surface() -> None:
    """A tip that cannot follow is not pulled ever harder."""
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(3, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    x = rng.normal(size=(3, 3)) * 0.05
    way = Way()
    slider = Slider(way, x)
    for _ in range(50):
        slider.update(normals, x, x)
        away = slider.references - x
        assert np.abs(np.sum(away * normals, axis=1)).max() < 1e-12
        assert np.linalg.norm(away, axis=1).max() <= way.leash + 1e-12


def test_fingers_of_a_pair_slide_in_turn_and_the_others_rest_meanwhile() -> None:
    """What rests holds an object that is free to turn along."""
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(3, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    x = rng.normal(size=(3, 3)) * 0.05
    slider = Slider(Way(pair=True, turns=4), x)
    moved = []
    for _ in range(16):
        slider.update(normals, x, x)
        moved.append(np.linalg.norm(slider.rates, axis=1) > 0.0)
    first, pair = np.array(moved)[:, 0], np.array(moved)[:, 1:]
    assert (first ^ pair.all(axis=1)).all() and (first ^ pair.any(axis=1)).all()
    assert 4 <= first.sum() <= 12


@pytest.mark.parametrize("kind", SINGLE)
def test_controllers_of_three_contacts_refuse_a_pair(kind: str) -> None:
    """They do not know virtual contacts."""
    with pytest.raises(ValueError, match="three contacts"):
        Slider(Way(pair=True, kind=kind), np.zeros((3, 3)))


def test_a_cell_that_does_not_vary_is_dead_and_one_that_is_not_a_number_too() -> None:
    """Found while taring, before anything is touched."""
    samples = np.random.default_rng(0).normal(size=(50, 3, 6))
    samples[:, 1] = 0.3
    samples[7, 2, 4] = np.nan
    assert Feel(0.012).tare(samples) == [1, 2]


def test_a_slider_tells_how_fast_its_references_go_and_no_faster_than_joints_follow() -> None:
    """Along the surface, at most ``most`` an update; a pace is a share of it."""
    rng = np.random.default_rng(2)
    normals = rng.normal(size=(3, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    x = rng.normal(size=(3, 3)) * 0.05
    way = Way()
    for pace in (1.0, 0.25):
        slider = Slider(way, x)
        slider.update(normals, x, x, pace)
        assert np.abs(np.sum(slider.rates * normals, axis=1)).max() < 1e-12
        fastest = np.linalg.norm(slider.rates, axis=1).max() * PERIOD
        assert fastest == pytest.approx(pace * way.most)


def test_a_joint_at_its_stop_is_asked_for_nothing_and_the_tips_move_all_the_same(
    model: HandModel,
) -> None:
    """Left in, it would owe its share, and the other joints would run after it."""
    q = opened(np.array(model.robot.arm.rest), 0.5, 0.95)
    at_rest = model.place(q, np.zeros(11))
    normals = np.array([[1.0, 0.0, 0.0], [-0.8, 0.6, 0.0], [-0.8, -0.6, 0.0]])
    references = at_rest.x + [0.0, 0.0, 0.003]
    none = np.zeros(3)
    law = Law(model)

    def accelerations(q: np.ndarray) -> np.ndarray:
        at = model.place(q, np.zeros(11))
        tau = law.slide(0.002, at, normals, references, none, none, q[7:])
        return np.asarray(np.linalg.solve(at.M, tau - at.h))

    free = accelerations(q)
    joint = int(np.argmax(np.abs(free[:7])))
    lower, upper = model.lower.copy(), model.upper.copy()
    (model.upper if free[joint] > 0.0 else model.lower)[joint] = q[joint]
    try:
        stopped = accelerations(q)
    finally:
        model.lower[:], model.upper[:] = lower, upper
    assert abs(free[joint]) > 0.5
    assert abs(stopped[joint]) < 1e-6
    wished = at_rest.JS @ free
    assert np.abs(at_rest.JS @ stopped - wished).max() < 0.1 * np.abs(wished).max()


def test_legs_have_speeds_of_their_own() -> None:
    """Slow near the object, faster elsewhere; legs begin where the ones before end."""
    a, b = np.zeros(11), np.full(11, 0.7)
    path = Path([a, b, a], [0.35, 0.7])
    assert path.begins(1) == pytest.approx(2.0)
    assert path.duration == pytest.approx(3.0)


def test_a_way_has_room_around_the_object_and_none_through_it_or_down_to_the_table(
    model: HandModel,
) -> None:
    """Told by the tips, from where the point to grasp is believed to be."""
    rng = np.random.default_rng(0)
    poses = []
    for side in (0.0, 0.3):
        R, p = look(GUESS, 0.8, side, 0.0)
        arm = solve(model, R, p - 0.16 * R[:, 2], rng)
        assert arm is not None
        poses.append(opened(arm, 0.3, 0.3))
    R, p = look(GUESS, 0.8, 0.0, 0.0)
    arm = solve(model, R, p, rng)
    assert arm is not None
    inside = opened(arm, 0.3, 0.65)

    def room(end: np.ndarray) -> float:
        return _room(model, GUESS, Path([poses[0], poses[0], poses[0], end]), 3)

    assert room(poses[1]) > 0.1
    assert room(inside) < 0.07
    high = Guess(GUESS.point + [0.0, 0.0, 0.3], UP)
    assert _room(model, high, Path([poses[0], poses[0], poses[0], poses[1]]), 3) == -np.inf


def test_a_hand_beside_the_object_rises_while_it_opens_so_that_no_finger_meets_the_table(
    model: HandModel,
) -> None:
    """Straight back from a level palm, a finger that opens would be below the floor."""
    rng = np.random.default_rng(1)
    R, p = look(GUESS, 1.2, 0.3, np.pi)
    arm = solve(model, R, p, rng)
    assert arm is not None
    start = opened(arm, 0.5, 1.2)

    def lowest(q: np.ndarray) -> float:
        return float((model.place(q, np.zeros(11)).x - GUESS.point)[:, 2].min())

    straight = min(lowest(opened(arm, 0.5, 0.3)), lowest(start))
    assert straight < FLOOR - 0.01
    way = elsewhere(model, GUESS, THREE, model.place(start, np.zeros(11)), None, rng)
    assert way is not None
    low = [lowest(way.at(t)[0]) for t in np.linspace(0.0, way.begins(3), 40)]
    assert min(low) > min(lowest(start), FLOOR) - 0.005
    assert lowest(way.at(way.begins(2))[0]) > FLOOR
