"""The way: it is kept, and prefers floor that was seen; what only seems to move does not move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from base.platform import PERIOD, Platform
from base.remembered import Remembered
from base.seen import Seen
from base.view import View
from base.way_map import WayMap
from deploy.robot import Robot, load_robot
from deploy.task import BaseTask
from services.messages import Array, Scan
from sim.kinematic import KinematicRobot
from sim.worlds import clutter

NONE = np.zeros((0, 2))
GOAL = np.array([3.0, 0.0])


def post(y: float) -> Array:
    """(n, 2) the outline of a thing half a metre wide, ahead."""
    angle = np.linspace(0, 2 * np.pi, 60)
    return np.array([1.5, y]) + 0.25 * np.column_stack([np.cos(angle), np.sin(angle)])


def scan_of(ranges: Array, t: float = 0.0) -> Scan:
    """All round, from straight ahead on."""
    return Scan(t, 0.0, 2 * np.pi / len(ranges), ranges, 8.0)


def test_of_two_ways_as_good_the_one_taken_is_kept() -> None:
    """Something ahead that noise shifts by 2 cm to either side is passed on one side throughout."""
    grid, way, rng = WayMap(0.33, 0.56), None, np.random.default_rng(3)
    sides = []
    for _ in range(30):
        way = grid.search(np.zeros(2), GOAL, post(rng.uniform(-0.02, 0.02)), NONE, way)
        sides.append(way.points[np.argmin(np.abs(way.points[:, 0] - 1.5)), 1] > 0)
    assert len(set(sides)) == 1


def test_a_way_that_is_much_better_replaces_the_one_taken() -> None:
    """Once the obstacle has moved aside, straight on."""
    grid = WayMap(0.33, 0.56)
    way = grid.search(np.zeros(2), GOAL, post(0.0), NONE)
    assert np.abs(way.points[:, 1]).max() > 0.3
    way = grid.search(np.zeros(2), GOAL, post(-1.5), NONE, way)
    assert np.abs(way.points[:, 1]).max() < 0.05


def test_floor_that_was_never_seen_costs_more() -> None:
    """Of two ways as short round an obstacle, the one over floor that beams went over."""
    grid, seen = WayMap(0.33, 0.56), Seen()
    angle = 2 * np.pi * np.arange(360) / 360
    for left in (True, False):
        seen = Seen()
        open_ = (np.sin(angle) > 0) == left
        seen.add(View(scan_of(np.where(open_, 6.0, 0.4)), np.zeros(2), 0.0), np.zeros(2))
        way = grid.search(np.zeros(2), GOAL, post(0.0), NONE, None, seen)
        assert (way.points[np.argmax(np.abs(way.points[:, 1])), 1] > 0) == left


def test_a_standing_point_is_remembered_until_a_beam_goes_through_it() -> None:
    """Seen once, kept while hidden, dropped when the beams that would meet it go on."""
    memory = Remembered()
    memory.add(0.0, np.array([[2.0, 0.0]]))
    hidden = View(scan_of(np.full(360, 1.0), 0.1), np.zeros(2), 0.0)
    memory.forget(hidden)
    np.testing.assert_allclose(memory.points, [[2.0, 0.0]])
    memory.forget(View(scan_of(np.full(360, 5.0), 0.2), np.zeros(2), 0.0))
    assert not len(memory.points)


@pytest.mark.parametrize("seed", [5, 21])
def test_in_clutter_that_stands_nothing_is_taken_for_moving(robot: Robot, seed: int) -> None:
    """Whatever comes into view from behind what: in less than 1 scan of 100 anything moves."""
    world = clutter(seed)
    task = BaseTask.model_validate({"behaviour": "find_way", "goal": world.goal})
    platform = Platform(robot, task, avoid=True)
    plant = KinematicRobot(robot, world.obstacles, world.start, seed)
    command, moving = np.zeros(3), []
    for i in range(300):
        estimate, scan, _ = plant.step(i * PERIOD, command)
        command = platform.step(i * PERIOD, estimate, None, scan)[0].velocity
        assert platform.picture is not None
        moving.append(platform.picture.scan is not None and platform.picture.moving.any())
    assert np.mean(moving) < 0.01


@pytest.mark.parametrize("fault", ["laser silent", "laser blinded", "no estimate", "invalid"])
def test_on_its_way_it_stands_within_a_second_of_losing_its_senses(
    robot: Robot, fault: str
) -> None:
    """Laser or odometry, silent or useless: the reason is stated, and the command is zero."""
    world = clutter(3)
    task = BaseTask.model_validate({"behaviour": "find_way", "goal": world.goal})
    platform = Platform(robot, task, avoid=True)
    plant = KinematicRobot(robot, world.obstacles, world.start, 3)
    command, kept = np.zeros(3), None
    for i in range(120):
        estimate, scan, _ = plant.step(i * PERIOD, command)
        heard = estimate
        if i >= 100:
            if fault == "laser silent":
                scan = kept
            elif fault == "laser blinded" and scan is not None:
                scan = replace(scan, ranges=np.zeros(len(scan.ranges)))
            elif fault == "no estimate":
                heard = None
            elif fault == "invalid":
                heard = replace(estimate, valid=False, reason="odometry silent")
        else:
            kept = scan
        message, status = platform.step(i * PERIOD, heard, None, scan)
        command = message.velocity
        if i == 99:
            assert np.hypot(*command[:2]) > 0.1
    assert fault in status.reason and (command == 0).all()
    assert not plant.collided


@pytest.mark.parametrize(
    ("behaviour", "keys"),
    [
        ("find_way", {"goal": (1.0, 0.0, 0.0)}),
        ("position", {"goal": (1.0, 0.0, 0.0)}),
        ("dock", {"distance": 0.6}),
    ],
)
def test_what_needs_sideways_motion_is_refused_to_a_differential_platform(
    behaviour: str, keys: dict[str, object]
) -> None:
    """By name, and before anything moves."""
    task = BaseTask.model_validate({"behaviour": behaviour, **keys})
    with pytest.raises(ValueError, match=f"'{behaviour}' needs a holonomic platform"):
        Platform(load_robot("rmp_puma560"), task, avoid=True)
