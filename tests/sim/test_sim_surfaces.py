"""Signed surfaces tell distance and normal."""

from __future__ import annotations

import numpy as np
import pytest

from sim.surfaces import OBJECTS, scatter, touch

EXACT = ("cylinder", "box", "ellipsoid")


@pytest.mark.parametrize("name", OBJECTS)
def test_points_lie_on_the_surface_and_normals_are_its_slope(name: str) -> None:
    """Scattered points are on it; there the normal is the gradient of the distance."""
    surface, rng = OBJECTS[name], np.random.default_rng(3)
    q = scatter(surface, 200, rng)
    assert np.abs(surface.sense(q)[0]).max() < 1e-9
    assert np.all(np.abs(q) <= surface.half + 1e-9)
    p = q + 0.0005 * rng.normal(size=q.shape)
    h = 1e-7
    slope = [
        (surface.sense(p + h * e)[0] - surface.sense(p - h * e)[0]) / (2 * h) for e in np.eye(3)
    ]
    off = np.abs(np.stack(slope, axis=1) - surface.sense(p)[1]).max(axis=1)
    assert np.quantile(off, 0.9) < 0.02


@pytest.mark.parametrize("name", EXACT)
def test_tips_keep_their_radius(name: str) -> None:
    """A tip is brought to where it touches: its centre a radius off, the normal into the object."""
    surface, rng = OBJECTS[name], np.random.default_rng(4)
    p = scatter(surface, 200, rng) + 0.003 * rng.normal(size=(200, 3))
    centre, point, normal = touch(surface, p, 0.012)
    np.testing.assert_allclose(surface.sense(centre)[0], 0.012, atol=1e-9)
    np.testing.assert_allclose(centre + 0.012 * normal, point, atol=1e-12)
    assert np.all(surface.sense(point + 1e-4 * normal)[0] < 0.0)


def test_a_tip_rolls_over_an_edge() -> None:
    """At an edge the normal turns from one face's to the other's while the point stays."""
    box = OBJECTS["box"]
    edge = np.array([0.035, 0.0, 0.1])
    a = np.linspace(0.2, 1.3, 7)
    out = np.stack([np.cos(a), 0.0 * a, np.sin(a)], axis=1)
    _, point, normal = touch(box, edge + 0.012 * out, 0.012)
    np.testing.assert_allclose(point, np.tile(edge, (7, 1)), atol=1e-9)
    np.testing.assert_allclose(normal, -out, atol=1e-9)
