"""Fingertips meet ellipsoids exactly."""

from __future__ import annotations

import numpy as np
import pytest

from sim.hand_objects import THINGS
from sim.hand_skin import nearest
from sim.hand_world import HandWorld, Setting

SEMI = np.array([0.03, 0.0425, 0.085])


@pytest.mark.parametrize("away", [1e-7, 1e-3, 0.1])
def test_the_nearest_point_is_where_a_normal_through_the_point_starts(away: float) -> None:
    """From a point of the surface straight out and back, to a nanometre."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        u = rng.normal(size=3)
        on = SEMI * u / np.linalg.norm(u)
        normal = on / SEMI**2
        normal /= np.linalg.norm(normal)
        found = nearest(on + away * normal, SEMI)
        assert found is not None
        assert np.abs(found[0] - on).max() < 1e-9
        assert np.abs(found[1] - normal).max() < 1e-6


def test_a_point_inside_has_none() -> None:
    """A tip that deep is not laid a plate for."""
    assert nearest(np.array([0.0, 0.01, 0.02]), SEMI) is None


def test_a_tip_touches_a_bottle_from_a_tenth_of_a_micron_on_with_the_right_normal() -> None:
    """FCL's own contact with an ellipsoid needs up to a micron, and its normals jump."""
    world = HandWorld("platform_hand", Setting(thing="squirt"), np.random.default_rng(0))
    robot = world.robot
    q = np.array([*robot.arm.rest, 0.0, 0.65, 0.65, 0.65])
    piece = THINGS["squirt"].pieces[0]
    joint = world._object.getParentJoint()
    rng = np.random.default_rng(1)
    for _ in range(20):
        turn = rng.uniform(-np.pi, np.pi)
        u = np.array([np.cos(turn), np.sin(turn), rng.uniform(-0.5, 0.5)])  # off foot and neck
        on = SEMI * u / np.linalg.norm(u)
        normal = on / SEMI**2
        normal /= np.linalg.norm(normal)
        for depth, touches in ((1e-7, True), (-1e-7, False)):
            world.put(q)
            tip = world.tips()[0]
            X = world._object.getWorldTransform()
            X.set_rotation(np.eye(3))
            middle = on + (robot.hand.tip_radius - depth) * normal
            X.set_translation(tip - middle - [0.0, 0.0, piece.height])
            joint.setTransformFromParentBodyNode(X)
            world.step(np.zeros(11))
            rows = world.contacts().get("tip0")
            assert (rows is not None) == touches
            if rows is not None:
                reach = rows[0, :3] - tip
                assert reach / np.linalg.norm(reach) @ -normal > 1.0 - 1e-6
