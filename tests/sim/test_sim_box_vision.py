"""The camera that finds the box: error, covariance, lateness, what hides it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deploy.robot import TwoArmRobot, load_robot
from services.messages import Array, Vision
from sim.box_vision import ENOUGH, BoxVision, Scene
from sim.effects import NONE, Effects
from tests.sim.two_arm_loop import ROBOT, run, scenario

SIZE = (0.203, 0.279, 0.178)
SPEC = load_robot(ROBOT, TwoArmRobot).vision
assert SPEC is not None
NOTHING = np.zeros((0, 3))


def camera(seed: int = 1, dropout: float = 0.0) -> BoxVision:
    """A camera as described."""
    assert SPEC is not None
    return BoxVision(SPEC, SIZE, dropout, 1.0, np.random.default_rng(seed))


def scene(
    x: float, y: float = 0.0, starts: Array = NOTHING, ends: Array = NOTHING, radius: float = 0.05
) -> Scene:
    """The box at (x, y) before a platform at the origin."""
    return Scene(
        np.eye(3), np.zeros(3), np.eye(3), np.array([x, y, 0.839]), starts, ends,
        np.full(len(starts), radius),
    )  # fmt: skip


def watch(at: Scene, seconds: float, effects: Effects = NONE, dropout: float = 0.0) -> list[Vision]:
    """Everything said in that time."""
    eye = camera(dropout=dropout)
    steps = [k * 0.004 for k in range(round(seconds / 0.004))]
    return [m for t in steps for m in eye.step(t, lambda: at, effects)]


@pytest.mark.parametrize(("distance", "p", "r"), [(0.6, 0.005, 0.010), (2.25, 0.030, 0.060)])
def test_deviation_grows_with_distance(distance: float, p: float, r: float) -> None:
    """5 mm and 0.01 rad at 0.6 m, 30 mm and 0.06 rad at 2.25 m; the covariance says so."""
    seen = camera().deviation(distance)
    assert seen == pytest.approx((p, r), rel=0.03)
    stated = np.sqrt(np.diag(watch(scene(distance), 0.5)[0].covariance))
    np.testing.assert_allclose(stated, [seen[0]] * 3 + [seen[1]] * 3)


def test_error_has_the_stated_spread_and_stays_alike_for_a_second() -> None:
    """Over 400 s: NEES of 6 values near 6; correlation exp(-1) after 1 s."""
    at = scene(1.5)
    seen = watch(at, 400.0)
    rotations = [Rotation.from_matrix(m.R).as_rotvec() for m in seen]
    error = np.array([[*(m.p - at.p_WX), *r] for m, r in zip(seen, rotations, strict=True)])
    nees = np.mean(np.sum(error**2 / np.diag(seen[0].covariance), axis=1))
    assert nees == pytest.approx(6.0, rel=0.2)
    unit = error / error.std(axis=0)
    assert np.mean(unit[25:] * unit[:-25]) == pytest.approx(np.exp(-1), abs=0.12)


def test_box_out_of_sight_is_not_reported() -> None:
    """Behind the platform, too far, or off to the side there is no message."""
    assert watch(scene(1.0), 0.5)
    for at in (scene(-1.0), scene(5.0), scene(1.0, 2.5)):
        assert not watch(at, 0.5)


def test_what_stands_between_hides_the_box() -> None:
    """A bar across the view takes it away; one beside the box does not."""
    across = (np.array([[0.5, -0.5, 1.15]]), np.array([[0.5, 0.5, 1.15]]))
    beside = (np.array([[0.5, 0.4, 0.85]]), np.array([[1.0, 0.4, 0.85]]))
    assert camera().in_view(scene(1.0, 0.0, *across, radius=0.3)) < ENOUGH
    assert not watch(scene(1.0, 0.0, *across, radius=0.3), 0.5)
    assert camera().in_view(scene(1.0, 0.0, *beside)) == 1.0


def test_a_box_seen_in_part_is_known_less_well() -> None:
    """The stated deviation grows as the share in view shrinks."""
    bar = (np.array([[0.85, -0.5, 0.95]]), np.array([[0.85, 0.05, 0.95]]))
    at = scene(1.0, 0.0, *bar)
    share = camera().in_view(at)
    assert ENOUGH <= share < 1.0
    stated = float(np.sqrt(watch(at, 0.5)[0].covariance[0, 0]))
    assert stated == pytest.approx(camera().deviation(1.0)[0] / share)


def test_dropouts_and_blinding() -> None:
    """Half are lost where half are to be lost; a blinded or silenced camera finds nothing."""
    assert 60 < len(watch(scene(1.0), 5.0, dropout=0.5)) < 65 + 20
    assert not watch(scene(1.0), 0.5, Effects(dropout={"vision"}))
    assert not watch(scene(1.0), 0.5, Effects(blinded={"vision"}))


def test_it_is_late_by_its_delay_and_in_the_platforms_frame() -> None:
    """Stamped when the picture was taken, heard 25 ms later, relative to B at the stamp."""
    seen = run(scenario(platform_start=(-1.0, 0.5, 0.3)), 0.5)
    said = [(at, m) for at, m in seen.messages if isinstance(m, Vision)]
    assert all(0.025 <= at - m.t < 0.029 for at, m in said)
    c, s = np.cos(0.3), np.sin(0.3)
    p = [c * 1.0 + s * -0.5, -s * 1.0 + c * -0.5, 0.839]
    np.testing.assert_allclose(np.mean([m.p for _, m in said], axis=0), p, atol=0.05)
