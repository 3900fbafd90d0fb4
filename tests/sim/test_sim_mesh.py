"""Objects read from mesh files: checked when read, and touched where they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from sim import mesh
from sim.hand_objects import find
from sim.hand_world import HandWorld, Setting


def stored(folder: Path, made: trimesh.Trimesh, name: str = "thing.stl") -> str:
    """A mesh in a file."""
    made.export(folder / name)
    return str(folder / name)


def test_it_stands_on_its_foot_wherever_its_file_has_it(tmp_path: Path) -> None:
    """The middle of the bounds is over the origin, their bottom at 0."""
    made = trimesh.creation.box((0.08, 0.06, 0.2))
    made.apply_translation([3.0, -2.0, 7.0])
    file = stored(tmp_path, made, "Ann's & Bob's \"thing\".stl")
    found = mesh.read(file)
    np.testing.assert_allclose(found.size, [0.08, 0.06, 0.2], atol=1e-6)
    np.testing.assert_allclose(found.triangles.min(axis=(0, 1)), [-0.04, -0.03, 0.0], atol=1e-6)
    world = HandWorld("platform_hand", Setting(thing=file), np.random.default_rng(0))
    shape = world._object.getSkeleton().getBodyNode("object_round").getShapeNodes()[0]
    X = shape.getRelativeTransform()
    np.testing.assert_allclose(np.asarray(X.translation()).ravel(), [-3.0, 2.0, -6.9], atol=1e-6)


@pytest.mark.parametrize("away", [1e-4, 0.012, 0.3])
def test_the_nearest_point_of_a_box_on_faces_edges_and_corners(away: float) -> None:
    """As clamping to the box has it."""
    half = np.array([0.04, 0.03, 0.1])
    surface = mesh.Surface(np.asarray(trimesh.creation.box(2 * half).triangles))
    rng = np.random.default_rng(0)
    for _ in range(100):
        corner = rng.uniform(-1.0, 1.0, 3)
        out = corner / np.abs(corner).max() * half
        x = out + away * np.sign(out) * (np.abs(out) > 0.9 * half)
        on = np.clip(x, -half, half)
        if np.linalg.norm(x - on) < 1e-6:
            continue
        found = surface.nearest(x)
        assert found is not None
        np.testing.assert_allclose(found[0], on, atol=1e-12)
        np.testing.assert_allclose(found[1], (x - on) / np.linalg.norm(x - on), atol=1e-7)


def test_a_point_of_the_surface_has_no_direction() -> None:
    """Nothing to lay a plate by."""
    surface = mesh.Surface(np.asarray(trimesh.creation.box((1.0, 1.0, 1.0)).triangles))
    assert surface.nearest(np.array([0.5, 0.1, 0.2])) is None


def test_a_tip_that_presses_on_a_mesh_touches_it_and_nothing_else_of_it(tmp_path: Path) -> None:
    """One contact, of the plate; the mesh itself is for palm and links."""
    file = stored(tmp_path, trimesh.creation.cylinder(radius=0.05, height=0.2, sections=48))
    world = HandWorld("platform_hand", Setting(thing=file), np.random.default_rng(0))
    q = np.array([*world.robot.arm.rest, 0.0, 0.65, 0.65, 0.65])
    joint = world._object.getParentJoint()
    for depth, touches in ((1e-6, True), (-1e-6, False)):
        world.put(q)
        tip = world.tips()[0]
        X = world._object.getWorldTransform()
        X.set_rotation(np.eye(3))
        # a corner of the polygon is at the radius, on x
        X.set_translation(tip - [0.05 + world.robot.hand.tip_radius - depth, 0.0, 0.1])
        joint.setTransformFromParentBodyNode(X)
        world.step(np.zeros(11))
        rows = world.contacts().get("tip0")
        assert (rows is not None) == touches
        if rows is not None:
            assert len(rows) == 1
            np.testing.assert_allclose(rows[0, :3], tip - [0.012, 0.0, 0.0], atol=1e-5)


BOX = trimesh.creation.box((0.08, 0.06, 0.2))


def test_what_is_no_object_is_refused_with_the_way_on(tmp_path: Path) -> None:
    """Missing, of another kind, broken, open, in millimetres."""
    with pytest.raises(ValueError, match="there is no such file"):
        mesh.read(str(tmp_path / "none.stl"))
    with pytest.raises(ValueError, match=r"not a mesh file; known are \.stl"):
        mesh.read(str(tmp_path / "thing.step"))
    (tmp_path / "broken.ply").write_bytes(b"ply\nnonsense")
    with pytest.raises(ValueError, match="cannot be read as a mesh"):
        mesh.read(str(tmp_path / "broken.ply"))
    opened = BOX.copy()
    opened.update_faces(np.arange(len(BOX.faces)) > 0)
    with pytest.raises(ValueError, match="not closed; fill its holes"):
        mesh.read(stored(tmp_path, opened, "open.stl"))
    large = BOX.copy()
    large.apply_scale(1000.0)
    with pytest.raises(ValueError, match=r"200 m high.*scale it by 0.001"):
        mesh.read(stored(tmp_path, large, "large.stl"))
    with pytest.raises(ValueError, match="unknown object 'cup'; known: roll, bottle"):
        find("cup")
