"""Among obstacles: it stops before what it sees, finds its way round, and says when it cannot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from base.movers import Movers
from base.platform import PERIOD, Platform
from base.progress import HELD, STUCK
from base.way_map import WayMap
from deploy.robot import Robot
from deploy.task import BaseTask
from services.messages import Array, BaseStatus, Bumper, Scan
from sim.kinematic import KinematicRobot
from sim.obstacle_specs import Mover, Obstacle, Pillar, Wall


@dataclass
class Drive:
    """A platform and its plant, and what was said at each step."""

    platform: Platform
    plant: KinematicRobot
    commands: list[Array]
    said: list[BaseStatus]

    def run(self, duration: float, hear: Any = lambda now, scan: scan) -> BaseStatus:
        """Go on; ``hear`` turns the newest scan into what is heard. The last status."""
        for _ in range(round(duration / PERIOD)):
            now = len(self.said) * PERIOD
            estimate, scan, bumper = self.plant.step(now, self.commands[-1])
            message, status = self.platform.step(now, estimate, None, hear(now, scan), bumper)
            self.commands.append(message.velocity)
            self.said.append(status)
        return self.said[-1]


def drive(robot: Robot, obstacles: tuple[Obstacle, ...], **task: Any) -> Drive:
    """A platform at the origin with a task given by the keys of its table."""
    platform = Platform(robot, BaseTask.model_validate(task), avoid=True)
    return Drive(platform, KinematicRobot(robot, obstacles, (0, 0, 0), 1), [np.zeros(3)], [])


WALL = Wall(start=(1.5, -3.0), end=(1.5, 3.0))


@pytest.mark.parametrize("rule", ["optimum", "weighted"])
def test_it_stops_before_a_wall_that_its_goal_is_behind_and_says_so(
    robot: Robot, rule: str
) -> None:
    """Told to drive straight through, it stands short of the wall, blocked within seconds."""
    run = drive(robot, (WALL,), behaviour="drive_to", goal=(3.0, 0.0, 0.0), fusion=rule)
    status = run.run(6.0 + HELD)
    assert not run.plant.collided and run.plant.clearance < 0.1
    assert status.state == "blocked" and "held" in status.reason
    assert np.hypot(*run.commands[-1][:2]) < 1e-3


def test_a_goal_in_an_obstacle_and_a_way_that_is_shut_are_told_apart(robot: Robot) -> None:
    """Within four seconds of seeing it, and the platform stands."""
    inside = drive(robot, (Pillar(x=2, y=0, radius=0.3),), behaviour="find_way", goal=(2, 0, 0))
    status = inside.run(4.0)
    assert status.state == "blocked" and "in or too near" in status.reason
    room = [((1, -1), (1, 1)), ((1, 1), (-1, 1)), ((-1, 1), (-1, -1)), ((-1, -1), (1, -1))]
    walls = tuple(Wall(start=a, end=b) for a, b in room)
    shut = drive(robot, walls, behaviour="find_way", goal=(2, 0, 0))
    status = shut.run(4.0)
    assert status.state == "blocked" and "no way" in status.reason
    for run in (inside, shut):
        assert not run.plant.collided and np.abs(run.commands[-1]).max() < 0.01


def test_it_goes_round_a_wall_to_a_goal_behind_it(robot: Robot) -> None:
    """It arrives, and no step of its command is above the limits."""
    run = drive(robot, (Wall(start=(1, -0.5), end=(1, 0.5)),), behaviour="find_way", goal=(2, 0, 0))
    assert run.run(15.0).state == "arrived"
    assert run.plant.clearance > 0.02
    jerk = np.diff(np.array([np.zeros(3), *run.commands]), n=2, axis=0) / PERIOD**2
    assert (np.abs(jerk) <= np.array(robot.chassis.jerk_limit) + 1e-6).all()


def test_a_silent_laser_stops_it_within_a_second_and_a_new_scan_lets_it_go_on(
    robot: Robot,
) -> None:
    """The reason is stated while it stands."""
    run = drive(robot, (WALL,), behaviour="drive_to", goal=(0.6, 0.0, 0.0))
    run.run(1.0)
    assert run.commands[-1][0] > 0.2
    kept = run.plant._scan
    status = run.run(0.9, lambda now, scan: kept)
    assert "laser silent" in status.reason and (run.commands[-1] == 0).all()
    assert run.run(4.0).state == "arrived"


def test_a_blinded_laser_stops_it(robot: Robot) -> None:
    """A covered window reads nothing but zeros."""

    def covered(now: float, scan: Scan | None) -> Scan | None:
        if scan is None:
            return None
        zero = np.zeros(len(scan.ranges))
        return Scan(scan.t, scan.start, scan.increment, zero, scan.farthest)

    run = drive(robot, (WALL,), behaviour="drive_to", goal=(0.8, 0.0, 0.0))
    run.run(1.0)
    status = run.run(0.8, covered)
    assert status.reason == "laser blinded" and (run.commands[-1] == 0).all()


def test_it_makes_way_for_someone_who_walks_into_it(robot: Robot) -> None:
    """Standing still, it steps aside, and then stands again."""
    walker = Mover(points=((3.0, 0.05), (-3.0, 0.05)), speed=0.8)
    run = drive(robot, (walker,), behaviour="hold_still")
    run.run(9.0)
    assert not run.plant.collided
    assert "gives way" in {s.reason for s in run.said}
    assert run.said[-1].votes["give_way"][3] == 0.0


def test_a_platform_that_does_not_move_as_told_says_it_is_stuck(robot: Robot) -> None:
    """Wheels that spin: it stops trying, until a person lets it go on."""
    run = drive(robot, (), behaviour="drive_to", goal=(2.0, 0.0, 0.0))
    for i in range(round((STUCK + 1.6) / PERIOD)):
        estimate, scan, _ = run.plant.step(i * PERIOD, np.zeros(3))
        message, status = run.platform.step(i * PERIOD, estimate, None, scan)
    assert status.state == "blocked" and status.reason.startswith("stuck")
    assert (message.velocity == 0).all()
    run.platform.resume()
    assert run.platform.step(4.65, run.plant._estimated(4.65), None, scan)[1].state == "driving"


def test_it_backs_off_from_what_presses_a_bumper(robot: Robot) -> None:
    """A few centimetres, and does not go that way again at once."""
    run = drive(robot, (), behaviour="drive_to", goal=(2.0, 0.0, 0.0))
    run.run(1.0)
    before = run.plant.pose[0]
    for i in range(20, 60):
        estimate, scan, _ = run.plant.step(i * PERIOD, run.commands[-1])
        pressed = np.zeros(1) if i < 23 else np.zeros(0)
        message, status = run.platform.step(
            i * PERIOD, estimate, None, scan, Bumper(i * PERIOD, pressed)
        )
        run.commands.append(message.velocity)
    assert status.votes["respond_to_contact"] and "touched at 0 deg" in status.reason
    assert min(c[0] for c in run.commands) < -0.08
    assert run.plant.pose[0] < before + 0.25
    assert run.commands[-1][0] <= 1e-3


def test_docking_ends_square_at_its_distance(robot: Robot) -> None:
    """To 5 mm and 0.3 degrees in truth, from a wall that is seen aslant."""
    wall = Wall(start=(1.5, -1.5), end=(1.2, 1.5), thickness=0.1)
    run = drive(robot, (wall,), behaviour="dock", distance=0.6)
    for _ in range(40):
        if run.run(1.0).state == "docked":
            break
    along = np.array([-0.3, 3.0]) / math.hypot(0.3, 3.0)
    normal = np.array([along[1], -along[0]])
    away = abs(float(normal @ (run.plant.pose[:2] - [1.5, -1.5]))) - 0.05
    facing = math.atan2(normal[1], normal[0])
    assert run.said[-1].state == "docked"
    assert abs(away - 0.6) < 0.005
    assert abs(math.degrees(facing - run.plant.pose[2])) < 0.3


def test_docking_without_a_surface_is_blocked_within_three_seconds(robot: Robot) -> None:
    """It stands and says what it misses."""
    run = drive(robot, (), behaviour="dock", distance=0.6)
    status = run.run(3.0)
    assert status.state == "blocked" and "no surface" in status.reason
    assert (run.commands[-1] == 0).all()


@pytest.mark.parametrize(("gap", "open_"), [(0.80, True), (0.55, False)])
def test_a_gap_is_a_way_only_if_the_platform_fits(gap: float, open_: bool) -> None:
    """A door in a wall right across the map."""
    y = np.arange(-4, 4, 0.02)
    y = y[np.abs(y - 0.5) > gap / 2]
    wall = np.column_stack([np.full(len(y), 1.0), y])
    way = WayMap(fits=0.33, comfort=0.56).search(
        np.zeros(2), np.array([2.0, 0.0]), wall, np.zeros((0, 2))
    )
    assert (way.blocked == 0) == open_
    if open_:
        assert np.abs(way.points[:, 1] - 0.5).min() < 0.1


def test_who_walks_is_told_from_what_stands() -> None:
    """Speed and direction of a walker to 0.1 m/s after a second; a post has none."""
    rng = np.random.default_rng(2)
    movers = Movers()
    angle = np.linspace(2.2, 4.0, 12)
    arc = 0.25 * np.column_stack([np.cos(angle), np.sin(angle)])
    for i in range(12):
        walker = arc + [3.0, -1.0 + 0.06 * i]
        post = arc + [2.0, 2.0]
        points = np.vstack([walker, post]) + 0.006 * rng.standard_normal((24, 2))
        velocity = movers.track(0.1 * i, points)
    np.testing.assert_allclose(velocity[:12].mean(axis=0), [0.0, 0.6], atol=0.1)
    np.testing.assert_array_equal(velocity[12:], 0.0)
