"""The camera: where it says the board is, and when it does not see it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deploy.robot import load_robot
from services.messages import Array, Vision
from sim.disturbance import disturbance_from
from sim.effects import NONE, Effects, effects_at
from sim.obstacle_specs import Obstacle, Pillar, Wall
from sim.obstacles import Obstacles
from sim.scenario import Board
from sim.vision import VisionSensor

ROBOT = load_robot("xr4000_puma560")
assert ROBOT.vision is not None
CAMERA = ROBOT.vision
BOARD = Board(x=2.0, y=0.3, yaw=0.2)
TICK = 0.001


def sightings(
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *obstacles: Obstacle,
    board: Board = BOARD,
    seconds: float = 1.0,
    effects: Effects = NONE,
    **options: Any,
) -> list[tuple[float, Vision]]:
    """What a standing platform's camera says, with the times of arrival."""
    sensor = VisionSensor(
        CAMERA.model_copy(update=options),
        board.rotation(),
        board.position(),
        board.markers,
        Obstacles(obstacles),
        0.0,
        1.0,
        np.random.default_rng(2),
    )
    ticks = range(round(seconds / TICK))
    at = np.array(pose)
    return [(k * TICK, v) for k in ticks for v in sensor.step(k * TICK, at, effects)]


def errors(seen: list[tuple[float, Vision]], pose: tuple[float, float, float]) -> Array:
    """Position and rotation errors along axes of B, (n, 6)."""
    R_WB = Rotation.from_rotvec([0, 0, pose[2]]).as_matrix()
    p = R_WB.T @ (BOARD.position() - [pose[0], pose[1], 0.0])
    R = R_WB.T @ BOARD.rotation()
    return np.array([[*(v.p - p), *Rotation.from_matrix(v.R @ R.T).as_rotvec()] for _, v in seen])


def test_it_says_the_boards_pose_in_b_25_ms_late_30_times_a_second() -> None:
    """Without noise, exactly."""
    pose = (0.3, -0.2, 0.4)
    seen = sightings(pose, noise=(0.0, 0.0), noise_per_metre=(0.0, 0.0))
    np.testing.assert_allclose(errors(seen, pose), 0.0, atol=1e-12)
    assert {v.name for _, v in seen} == {"board"}
    assert 28 <= len(seen) <= 30
    for arrival, v in seen:
        assert arrival - v.t == pytest.approx(CAMERA.delay, abs=0.0011)


@pytest.mark.parametrize("markers", [(0.0,), (0.5,)])
def test_its_error_is_what_its_covariance_says(markers: tuple[float, ...]) -> None:
    """Also of the board's frame seen by a marker that is elsewhere on it."""
    board = BOARD.model_copy(update={"markers": markers})
    seen = sightings(board=board, seconds=60.0)
    found = np.cov(errors(seen, (0.0, 0.0, 0.0)).T)
    stated = seen[0][1].covariance
    scale = np.sqrt(np.outer(np.diag(stated), np.diag(stated)))
    np.testing.assert_allclose(found / scale, stated / scale, atol=0.12)


def test_noise_grows_with_distance() -> None:
    """Twice as far is nearly twice as bad."""
    near, far = (sightings((x, 0.3, 0.0), seconds=30.0) for x in (0.8, -1.4))
    spread = [errors(s, (x, 0.3, 0.0)).std(axis=0) for s, x in ((near, 0.8), (far, -1.4))]
    assert (spread[1] > 1.8 * spread[0]).all()


@pytest.mark.parametrize(
    ("pose", "seen"),
    [
        ((0.0, 0.3, 0.0), True),
        ((-1.0, 0.3, 0.0), True),
        ((-3.0, 0.3, 0.0), False),  # too far
        ((0.0, 0.3, 0.9), True),
        ((0.0, 0.3, 1.1), False),  # out of the field of view
        ((4.0, 0.3, math.pi), False),  # behind the board
        ((1.6, 2.5, -1.4), False),  # too oblique
    ],
)
def test_the_board_must_be_in_view(pose: tuple[float, float, float], seen: bool) -> None:
    """Near enough, ahead, and from the front."""
    assert bool(sightings(pose)) == seen


@pytest.mark.parametrize(
    ("obstacle", "hidden"),
    [
        (Pillar(x=1.0, y=0.15, radius=0.1), True),
        (Pillar(x=1.0, y=0.15, radius=0.1, height=0.8), False),
        (Pillar(x=1.0, y=0.6, radius=0.1), False),
        (Wall(start=(2.08, -2.0), end=(2.08, 3.0)), False),
    ],
)
def test_an_obstacle_in_the_line_of_sight_hides_it(obstacle: Obstacle, hidden: bool) -> None:
    """Not one beside the line, one that is looked over, or the wall it hangs on."""
    board = Board(x=2.0, y=0.3)
    assert bool(sightings((0.0, 0.0, 0.0), obstacle, board=board)) != hidden


def test_another_marker_does_when_one_is_hidden() -> None:
    """The nearest in view is used, and the pose is the board's all the same."""
    board = BOARD.model_copy(update={"markers": (-0.5, 0.5)})
    pose = (1.0, 0.8, 0.0)
    quiet = {"noise": (0.0, 0.0), "noise_per_metre": (0.0, 0.0)}
    for obstacles in ((), (Pillar(x=1.6, y=0.8, radius=0.05),)):
        seen = sightings(pose, *obstacles, board=board, **quiet)
        np.testing.assert_allclose(errors(seen, pose), 0.0, atol=1e-12)
        assert len(seen) > 25


@pytest.mark.parametrize("kind", ["dropout", "blinded"])
def test_disturbances_reach_the_camera(kind: str) -> None:
    """Nothing is said."""
    made = disturbance_from(kind, {"sensor": "vision", "duration": 60.0}, 0.0)
    assert not sightings(effects=effects_at(0.0, [made]))
