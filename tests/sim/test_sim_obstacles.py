"""Obstacles: rays and distances are what geometry says, movers are where they should be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.obstacle_specs import Box, Mover, Pillar, Wall
from sim.obstacles import Obstacles
from sim.scenario import World
from sim.shapes import NOTHING
from tests.sim.sim_loop import Recording, drive, scenario

THINGS = Obstacles(
    [
        Box(x=3.0, y=1.0, yaw=0.6, length=1.0, width=0.4),
        Wall(start=(-2.0, -2.0), end=(4.0, -3.0)),
        Pillar(x=1.5, y=-0.5, radius=0.3),
    ]
)
TICK = 0.001


def test_a_ray_ends_on_wall_and_pillar_where_geometry_says() -> None:
    """Straight on, at an angle, and past them."""
    shapes = Obstacles(
        [Wall(start=(2.0, -1.0), end=(2.0, 1.0)), Pillar(x=0.0, y=3.0, radius=0.5)]
    ).at(0.0)
    bearings = np.array([0.0, math.radians(20), math.pi / 2, math.pi, math.radians(45)])
    seen = shapes.cast(np.zeros(2), bearings, 8.0)
    expected = [1.95, 1.95 / math.cos(math.radians(20)), 2.5, 8.0, 8.0]
    np.testing.assert_allclose(seen, expected, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(x=st.floats(-1, 5), y=st.floats(-2, 3), bearing=st.floats(-4, 4))
def test_a_ray_ends_on_an_edge_and_crosses_none_before(x: float, y: float, bearing: float) -> None:
    """The distance to the nearest shape is zero where it ends and positive on the way."""
    shapes, origin = THINGS.at(0.0), np.array([x, y])
    if shapes.distance(origin[None])[0] < 0.01:
        return
    reach = float(shapes.cast(origin, np.array([bearing]), 20.0)[0])
    way = np.linspace(0.0, reach, 200)[:, None] * [math.cos(bearing), math.sin(bearing)]
    distance = shapes.distance(origin + way)
    assert (distance[:-1] > -1e-9).all()
    if reach < 20.0:
        assert abs(distance[-1]) < 1e-6


@settings(max_examples=60, deadline=None)
@given(x=st.floats(-1, 5), y=st.floats(-3.5, 3))
def test_nearest_points_lie_on_the_edges(x: float, y: float) -> None:
    """Going the distance in the direction stated leads to the edge, from outside and inside."""
    shapes, point = THINGS.at(0.0), np.array([x, y])
    distance, toward = shapes.nearest(point)
    assert distance.min() == pytest.approx(shapes.distance(point[None])[0])
    nearest = int(distance.argmin())
    reached = point + distance[nearest] * toward[nearest]
    assert abs(shapes.distance(reached[None])[0]) < 1e-6 or distance.min() < 0.0


def test_a_mover_walks_its_legs_stands_before_and_after_and_loops() -> None:
    """Position by time, at its speed."""
    legs = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0))
    once = Obstacles([Mover(points=legs, speed=0.5, start_at=1.0)])
    for t, at in [(0.0, (0, 0)), (1.0, (0, 0)), (3.0, (1, 0)), (6.0, (2, 0.5)), (99.0, (2, 1))]:
        np.testing.assert_allclose(once.at(t).circles[0, :2], at, atol=1e-12)
    np.testing.assert_allclose(once.velocities(6.0), [[0.0, 0.5]])
    np.testing.assert_allclose(once.velocities(99.0), [[0.0, 0.0]])
    again = Obstacles([Mover(points=legs, speed=0.5, start_at=1.0, loop=True)])
    around = (3.0 + math.sqrt(5.0)) / 0.5
    np.testing.assert_allclose(again.at(3.0 + around).circles[0, :2], (1, 0), atol=1e-9)


def test_clearance_is_from_edge_to_edge() -> None:
    """Of the platform's circle; a thousand metres where there is nothing."""
    assert Obstacles().clearance(0.0, [0, 0, 0], 0.3) == NOTHING
    pillar = Obstacles([Pillar(x=1.0, y=0.0, radius=0.2)])
    assert pillar.clearance(0.0, [0, 0, 0], 0.3) == pytest.approx(0.5)
    assert pillar.clearance(0.0, [0.8, 0, 0], 0.3) == pytest.approx(-0.3)


def test_a_platform_cannot_drive_through_a_wall() -> None:
    """Full speed against it: the rubber gives way by less than 25 mm, then the platform stands."""
    wall = Wall(start=(1.0, -2.0), end=(1.0, 2.0))
    run = drive(scenario(obstacle=(wall,)), 3.0, lambda _: (1.2, 0.0, 0.0))
    clearances = np.array([m.clearance for m in run.truth])
    assert clearances.min() > -0.025
    assert abs(clearances[-1]) < 0.003 and np.abs(run.velocity[-1]).max() < 0.01
    expected = 0.95 - 0.31 - run.truth[-1].pose[0]
    assert run.truth[-1].clearance == pytest.approx(expected, abs=1e-6)


def test_a_mover_pushes_a_standing_platform_along() -> None:
    """The platform is shoved at the person's speed."""
    person = Mover(points=((-2.0, 0.0), (2.0, 0.0)), speed=0.5)
    run = drive(scenario(obstacle=(person,)), 5.0, lambda _: (0.0, 0.0, 0.0))
    assert min(m.clearance for m in run.truth) > -0.03
    assert run.pose[-1, 0] == pytest.approx(-2.0 + 0.5 * 5.0 + 0.25 + 0.31, abs=0.02)


def _same(a: Recording, b: Recording) -> None:
    np.testing.assert_array_equal(a.pose, b.pose)
    for (_, x), (_, y) in zip(a.odometry, b.odometry, strict=True):
        np.testing.assert_array_equal(x.pose, y.pose)
    for (_, x), (_, y) in zip(a.imu, b.imu, strict=True):
        np.testing.assert_array_equal(x.gyro, y.gyro)
    for x, y in zip(a.arm, b.arm, strict=True):
        np.testing.assert_array_equal(x.wrench, y.wrench)


def test_obstacles_and_their_sensors_leave_everything_else_bit_identical() -> None:
    """A run with an obstacle out of reach, or without the new sensors, is the run without."""
    off = {name: {"enabled": False} for name in ("laser", "bumper", "vision")}
    far = Pillar(x=5.0, y=0.0, radius=0.2)

    def command(t: float) -> tuple[float, float, float]:
        return 0.3, 0.1 * math.sin(t), 0.2

    plain = drive(scenario(sensors={}, exact=False), 1.0, command)
    _same(plain, drive(scenario(sensors=off, exact=False), 1.0, command))
    _same(plain, drive(scenario(sensors={}, exact=False, obstacle=(far,)), 1.0, command))


@pytest.mark.parametrize(
    ("obstacle", "words"),
    [
        ({"kind": "tree", "x": 1}, "'pillar'"),
        ({"kind": "pillar", "x": 1, "y": 0, "radius": 0}, "greater than 0"),
        ({"kind": "wall", "start": [1, 1], "end": [1, 1]}, "same point"),
        ({"kind": "mover", "points": [[0, 0], [0, 0]], "speed": 1}, "twice in a row"),
    ],
)
def test_a_wrong_obstacle_is_refused(obstacle: dict, words: str) -> None:
    """With the reason."""
    with pytest.raises(ValueError, match=words):
        World(obstacle=(obstacle,))
