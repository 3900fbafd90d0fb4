"""The hand's own ways: where it reaches, what it squeezes with, how it slides and gives up."""

from __future__ import annotations

import numpy as np
import pytest

from arm.hand.feel import Feel
from arm.hand.model import HandModel
from arm.hand.reaching import DEPTH, Guess, Path, across, look, opened, solve
from arm.hand.sliding import Slider, Way
from arm.hand.squeeze import internal

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


def test_a_cell_that_does_not_vary_is_dead_and_one_that_is_not_a_number_too() -> None:
    """Found while taring, before anything is touched."""
    samples = np.random.default_rng(0).normal(size=(50, 3, 6))
    samples[:, 1] = 0.3
    samples[7, 2, 4] = np.nan
    assert Feel(0.012).tare(samples) == [1, 2]
