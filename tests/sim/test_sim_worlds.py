"""Worlds for campaigns and the kinematic platform that drives in them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, label

from deploy.robot import load_robot
from services.messages import BaseCommand
from sim.gridplan import Grid
from sim.kinematic import PERIOD, Imperfect, KinematicRobot
from sim.obstacle_specs import Mover, Pillar, Wall
from sim.obstacles import Obstacles
from sim.scenario import load_scenario
from sim.simulator import Simulator
from sim.worlds import KINDS, MARGIN, PASSAGE, ROOM, clutter, crossing
from tests.sim.sim_loop import scenario

ROBOT = load_robot("xr4000_puma560")
RADIUS = ROBOT.chassis.radius
PERFECT = Imperfect(
    lag=0.0,
    roughness=(0.0, 0.0, 0.0),
    pose_noise=(0.0, 0.0, 0.0),
    velocity_noise=(0.0, 0.0, 0.0),
    laser_noise=0.0,
)


# --- worlds ---------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(10))
def test_clutter_has_a_path_wide_enough(seed: int) -> None:
    """Found anew with a distance transform on a grid of 2 cm."""
    world = clutter(seed)
    (x0, y0), (x1, y1) = ROOM
    cell = 0.02
    xs, ys = np.arange(x0, x1, cell), np.arange(y0, y1, cell)
    points = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)
    shapes = Obstacles(world.obstacles).at(0.0)
    empty = (shapes.distance(points) > 0.0).reshape(len(xs), len(ys))
    wide = distance_transform_edt(empty) * cell >= PASSAGE * RADIUS
    regions, _ = label(wide, structure=np.ones((3, 3)))
    ends = [
        regions[round((p[0] - x0) / cell), round((p[1] - y0) / cell)]
        for p in (world.start, world.goal)
    ]
    assert ends[0] == ends[1] != 0


@pytest.mark.parametrize("kind", KINDS)
def test_worlds_are_by_seed_and_leave_start_and_goal_free(kind: str) -> None:
    """Equal seeds, equal worlds; others differ; the shortest way is no shorter than straight."""
    make = KINDS[kind]
    assert make(3) == make(3) != make(4)
    for seed in range(20):
        world = make(seed)
        room = MARGIN if kind == "clutter" else 0.1
        for pose in (world.start, world.goal):
            assert Obstacles(world.obstacles).clearance(0.0, pose, RADIUS) >= room
        assert math.dist(world.start[:2], world.goal[:2]) <= world.shortest < 12.0


def test_the_shortest_way_round_a_wall_is_two_tangents_and_an_arc() -> None:
    """Within 1 % of what geometry says; infinite where there is no way."""
    grid = Grid((0.0, -2.0), (4.0, 2.0))
    grid.add(Obstacles([Wall(start=(2.0, -3.0), end=(2.0, 0.0), thickness=0.001)]).at(0.0))
    a, b = np.array([0.5, -0.5]), np.array([3.5, -0.5])
    r, far = 0.3, math.hypot(1.5, 0.5)
    tangent = math.sqrt(far * far - r * r)
    arc = r * (math.pi + 2 * math.atan2(0.5, 1.5) - 2 * math.acos(r / far))
    exact = 2 * tangent + arc
    assert grid.shortest(a, b, r) == pytest.approx(exact, rel=0.01)
    grid.add(Obstacles([Wall(start=(2.0, 0.5), end=(2.0, 3.0), thickness=0.001)]).at(0.0))
    assert grid.shortest(a, b, r) == math.inf


def test_the_person_who_crosses_would_hit_a_platform_that_does_not_look() -> None:
    """Straight on at the cruising speed, nearly every seed collides; none faster than 1 m/s."""
    hits = 0
    for seed in range(30):
        world = crossing(seed)
        person = world.obstacles[-1]
        assert isinstance(person, Mover) and person.speed <= 1.0
        robot = KinematicRobot(ROBOT, world.obstacles, world.start, seed)
        way = np.subtract(world.goal, world.start)[:2]
        velocity = 0.5 * way / np.linalg.norm(way)
        for k in range(200):
            robot.step(k * PERIOD, (*velocity, 0.0))
        hits += robot.collided
    assert hits >= 27


def test_the_scenario_clutter_is_a_world_of_the_generator() -> None:
    """As its comment says."""
    made, world = load_scenario("clutter"), clutter(4)
    assert made.world.obstacle == world.obstacles
    assert made.world.platform_start == world.start and made.task.base.goal == world.goal


# --- the kinematic platform -----------------------------------------------------------------


def test_it_drives_as_the_simulated_platform_does() -> None:
    """Same commands, same way after 3 s, but for the turns that the arm's inertia causes."""

    def command(t: float) -> np.ndarray:
        return np.array([0.6 * math.sin(t), 0.3, 0.5 * math.cos(t)])

    fast = KinematicRobot(ROBOT, (), (0.0, 0.0, 0.0), 1, PERFECT)
    simulator = Simulator(scenario(), 1)
    base, held = BaseCommand(t=0.0, velocity=command(0.0)), command(0.0)
    for tick in range(3001):
        now = tick / 1000
        if tick % 50 == 0:
            fast.step(now, held)
            held = command(now)
            base = BaseCommand(t=now, velocity=held)
        simulator.step(now, None, base)
    off = np.abs(fast.pose - simulator.physics.pose)
    assert (off < [0.06, 0.06, math.radians(3.0)]).all(), off


def test_it_senses_as_the_simulated_platform_does() -> None:
    """Scans at 10 Hz, 30 ms late and true at their stamp; the newest is kept."""
    wall = Wall(start=(3.05, -5.0), end=(3.05, 5.0))
    robot = KinematicRobot(ROBOT, [wall], (0.0, 0.0, 0.0), 1, PERFECT)
    where = {}
    for k in range(60):
        now = k * PERIOD
        estimate, scan, bumper = robot.step(now, (0.5, 0.0, 0.0))
        where[k] = robot.pose[0]
        np.testing.assert_allclose(estimate.pose, robot.pose)
        assert estimate.t == now
        if k == 0:
            assert scan is None
            continue
        assert scan is not None and bumper is not None and not len(bumper.pressed)
        assert 0.03 - 1e-9 <= now - scan.t <= 0.13 + 1e-9
        assert scan.ranges[180] == pytest.approx(3.0 - where[round(scan.t / PERIOD)], abs=0.002)


def test_it_notices_a_collision_and_does_not_pass_through() -> None:
    """The smallest clearance is kept; equal seeds give equal runs."""
    ends = []
    for _ in range(2):
        robot = KinematicRobot(ROBOT, [Pillar(x=1.0, y=0.0, radius=0.2)], (0, 0, 0), 5)
        for k in range(60):
            _, _, bumper = robot.step(k * PERIOD, (0.5, 0.0, 0.0))
        assert robot.collided and -0.01 < robot.clearance < 0.0
        assert bumper is not None and len(bumper.pressed) == 1
        assert math.dist(robot.pose[:2], (1.0, 0.0)) >= RADIUS + 0.2 - 1e-9
        ends.append(robot.pose)
    np.testing.assert_array_equal(*ends)


def test_a_differential_one_does_not_move_sideways() -> None:
    """Whatever it is told."""
    chassis = ROBOT.chassis.model_copy(update={"drive": "differential"})
    robot = KinematicRobot(ROBOT.model_copy(update={"chassis": chassis}), (), (0.0, 0.0, 0.0), 1)
    for k in range(40):
        robot.step(k * PERIOD, (0.0, 0.5, 0.0))
        assert robot.velocity[1] == 0.0


def test_its_estimate_drifts_by_the_scale_of_its_wheels() -> None:
    """Half a per cent of the way."""
    wheels = Imperfect(scale=(1.005, 1.0), pose_noise=(0.0, 0.0, 0.0))
    robot = KinematicRobot(ROBOT, (), (0.0, 0.0, 0.0), 1, wheels)
    for k in range(200):
        estimate, _, _ = robot.step(k * PERIOD, (0.5, 0.0, 0.0))
    assert estimate.pose[0] / robot.pose[0] == pytest.approx(1.005, abs=1e-4)
