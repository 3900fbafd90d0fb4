"""Paths: velocity is the derivative of pose, without steps, and they go where they are told."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter

from base.paths import Path, build
from deploy.task import PathSpec

SPECS: dict[str, dict[str, Any]] = {
    "sway": {"kind": "sway", "amplitude": [0.1, 0.3], "yaw_deg": 5.0},
    "circle": {"kind": "circle", "radius": 0.5, "speed": 0.2},
    "tangent": {"kind": "circle", "radius": 0.5, "speed": 0.2, "heading": "tangent"},
    "turn": {"kind": "circle", "radius": 0.5, "speed": 0.2, "loop": False},
    "line": {"kind": "line", "points": [[1.0, 0.5, 0.4]], "speed": 0.2},
    "corner": {"kind": "polyline", "points": [[0.5, 0, 0], [0.5, 0.5, 1.0]], "speed": 0.1},
    "loop": {
        "kind": "polyline",
        "points": [[0, 0.25, 0], [0, -0.25, 0]],
        "speed": 0.1,
        "loop": True,
    },
    "turn on the spot": {"kind": "line", "points": [[0, 0, 1.5]], "speed": 0.1},
    "too short to blend": {"kind": "polyline", "points": [[0.01, 0, 0], [1, 0, 0]], "speed": 1.0},
}


def make(**spec: Any) -> Path:
    """A path from the keys of its table."""
    return build(TypeAdapter(PathSpec).validate_python(spec))


@pytest.mark.parametrize("name", SPECS)
def test_velocity_is_the_derivative_of_pose(name: str) -> None:
    """Central differences of the pose give the velocity to 1e-6 m/s, at every instant."""
    path, h = make(**SPECS[name]), 1e-4
    for s in np.linspace(0.01, 30.0, 997):
        slope = (path.pose(s + h) - path.pose(s - h)) / (2 * h)
        np.testing.assert_allclose(path.velocity(s), slope, atol=1e-6)


@pytest.mark.parametrize("name", SPECS)
def test_velocity_has_no_step(name: str) -> None:
    """The velocity changes by no more than 2 m/s^2 (or rad/s^2) anywhere."""
    path = make(**SPECS[name])
    velocity = np.array([path.velocity(s) for s in np.arange(0, 30, 0.001)])
    assert np.abs(np.diff(velocity, axis=0)).max() <= 2.0 * 0.001


@pytest.mark.parametrize("name", SPECS)
def test_path_starts_at_the_start_pose(name: str) -> None:
    """Every path starts at (0, 0, 0)."""
    np.testing.assert_allclose(make(**SPECS[name]).pose(0.0), 0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["line", "corner", "turn on the spot", "too short to blend"])
def test_polyline_starts_at_rest_and_ends_at_rest_at_its_last_point(name: str) -> None:
    """At its duration a path without loop stands on its last point, and stays there."""
    spec = SPECS[name]
    path = make(**spec)
    np.testing.assert_allclose(path.velocity(0.0), 0.0, atol=1e-12)
    for s in (path.duration, path.duration + 10.0):
        np.testing.assert_allclose(path.pose(s), spec["points"][-1], atol=1e-9)
        np.testing.assert_allclose(path.velocity(s), 0.0, atol=1e-9)


def test_line_is_driven_at_its_speed_between_the_blends() -> None:
    """Half way along a leg the speed is the one asked for."""
    path = make(kind="line", points=[[2.0, 0, 0]], speed=0.2)
    assert path.velocity(path.duration / 2)[0] == pytest.approx(0.2)


def test_corner_is_cut_by_less_than_the_blend_allows() -> None:
    """At 0.1 m/s the blended corner stays within 10 mm of the true one."""
    path = make(**SPECS["corner"])
    poses = np.array([path.pose(s) for s in np.arange(0, path.duration, 0.01)])
    assert np.hypot(*(poses[:, :2] - [0.5, 0.0]).T).min() < 0.010


def test_single_turn_ends_where_it_began() -> None:
    """One turn of a circle ends at rest at the start."""
    path = make(**SPECS["turn"])
    np.testing.assert_allclose(path.pose(path.duration), 0.0, atol=1e-9)
    np.testing.assert_allclose(path.velocity(path.duration), 0.0, atol=1e-9)


def test_circle_keeps_its_radius_and_speed() -> None:
    """Every point is one radius from the centre, passed at the speed asked for."""
    path = make(**SPECS["tangent"])
    for s in np.linspace(0, 20, 50):
        x, y, heading = path.pose(s)
        assert math.hypot(x, y - 0.5) == pytest.approx(0.5)
        vx, vy, _ = path.velocity(s)
        assert math.hypot(vx, vy) == pytest.approx(0.2)
        assert math.remainder(math.atan2(vy, vx) - heading, 2 * math.pi) == pytest.approx(0)


point = st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-3, 3))


@settings(max_examples=60, deadline=None)
@given(
    points=st.lists(point, min_size=1, max_size=6),
    speed=st.floats(0.01, 1.0),
    acceleration=st.floats(0.05, 1.5),
    loop=st.booleans(),
)
def test_any_polyline_is_smooth_and_no_faster_than_asked(
    points: list[tuple[float, float, float]], speed: float, acceleration: float, loop: bool
) -> None:
    """Whatever the points, the speed asked for is never exceeded and nothing jumps."""
    if max(abs(value) for p in points for value in p) < 0.01:
        return
    path = make(kind="polyline", points=points, speed=speed, acceleration=acceleration, loop=loop)
    s = np.linspace(0, min(path.duration, 60.0), 2001)
    velocity = np.array([path.velocity(x) for x in s])
    assert np.hypot(velocity[:, 0], velocity[:, 1]).max() <= speed * (1 + 1e-9)
    # a smooth step's peak slope is 1.5 times its mean
    limit = 1.5 * acceleration * (s[1] - s[0]) * (1 + 1e-6) + 1e-9
    assert np.abs(np.diff(velocity, axis=0)).max() <= limit
