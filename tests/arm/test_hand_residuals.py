"""The residuals' gradients are what they claim to be, and the printed ones are not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.hand import angles, curvature, gravity, residuals, virtual
from arm.hand.probing import Probing

seeds = st.integers(0, 2**32 - 1)
counts = st.integers(2, 5)


def _contacts(seed: int, k: int, flat: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Normals into an object and points somewhere on it; ``flat`` scales the normals' z."""
    rng = np.random.default_rng(seed)
    n = rng.normal(size=(k, 3)) * [1.0, 1.0, flat]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return n, -0.05 * n + 0.02 * rng.normal(size=(k, 3))


@settings(deadline=None)
@given(seeds, counts)
def test_gradients_are_those_of_sphere_and_plane(seed: int, k: int) -> None:
    """Finite differences on the assumed surfaces give the gradients of both errors."""
    n, x = _contacts(seed, k)
    rho, moment = residuals.residuals(n, x)
    g_force, g_moment = residuals.gradients(n, x)
    rng, h = np.random.default_rng([seed, 1]), 1e-6
    for i in range(k):
        t = np.cross(n[i], rng.normal(size=3))
        t /= np.linalg.norm(t)
        turned = [n[i] * np.cos(s) - t * np.sin(s) for s in (h, -h)]  # on a sphere of radius r_c
        e = [np.sum((rho - n[i] + v) ** 2) for v in turned]
        assert (e[0] - e[1]) / (2 * h) == pytest.approx(g_force[i] @ t, abs=1e-6)
        e = [np.sum((moment + np.cross(s * t, n[i])) ** 2) for s in (h, -h)]  # origin held
        assert (e[0] - e[1]) / (2 * h) == pytest.approx(g_moment[i] @ t, abs=1e-6)
        assert abs(g_force[i] @ n[i]) + abs(g_moment[i] @ n[i]) < 1e-12


@settings(deadline=None)
@given(seeds, counts)
def test_projector_of_4_19_does_nothing(seed: int, k: int) -> None:
    """In exact geometry the null-space composite is the sum: the gradients are orthogonal."""
    n, x = _contacts(seed, k)
    g_force, g_moment = residuals.gradients(n, x)
    size = np.linalg.norm(g_force) * np.linalg.norm(g_moment)
    assert abs(np.sum(g_force * g_moment)) < 1e-12 * max(1.0, size)
    both = [residuals.displacements(n, x, kind=kind) for kind in ("null", "sum")]
    np.testing.assert_allclose(*both, atol=1e-12)


def test_printed_angles_are_not_orthogonal() -> None:
    """In theta and phi the projector takes something away: the parametrisation's, up to 0.1."""
    cosines = []
    for seed in range(200):
        g, h = (v.ravel() for v in angles.gradients(*_contacts(seed, 3)))
        cosines.append(abs(g @ h) / np.linalg.norm(g) / np.linalg.norm(h))
    assert 0.03 < np.mean(cosines) < 0.3


@settings(deadline=None)
@given(seeds, counts)
def test_printed_cartesian_form_lacks_a_factor(seed: int, k: int) -> None:
    """With 1 / cos phi Eq 4.28 is the coordinate-free gradient; without, only where phi is 0."""
    n, x = _contacts(seed, k)
    for kind in ("force", "moment"):
        free = residuals.displacements(n, x, kind=kind)
        np.testing.assert_allclose(
            angles.displacements(n, x, kind=kind, corrected=True), free, atol=1e-9
        )
    flat, x = _contacts(seed, k, flat=0.0)
    np.testing.assert_allclose(
        angles.displacements(flat, x, kind="force"),
        residuals.displacements(flat, x, kind="force"),
        atol=1e-12,
    )


def test_printed_cartesian_form_is_wrong_elsewhere() -> None:
    """At phi = 1.2 the printed step along theta is a third of what it should be."""
    phi = 1.2
    n = np.array([[-np.cos(phi), 0.0, -np.sin(phi)], [0.0, 1.0, 0.0]])
    x = -0.05 * n
    printed = angles.displacements(n, x, kind="force")
    right = residuals.displacements(n, x, kind="force")
    assert printed[0, 1] == pytest.approx(np.cos(phi) * right[0, 1], rel=1e-9)


@settings(deadline=None)
@given(seeds)
def test_balanced_contacts_stay(seed: int) -> None:
    """Where both residuals are zero nothing moves, in whatever orientation."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    a = 2.0 * np.pi * np.arange(3) / 3.0
    n = -np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1) @ turn
    for kind in residuals.KINDS:
        assert np.abs(residuals.displacements(n, -0.05 * n, kind=kind)).max() < 1e-12


def test_sequential_waits_for_the_force() -> None:
    """C* descends the moment only when the force has converged, and does not look back."""
    stages = residuals.Sequential(0.05)
    far, near = np.array([0.5, 0.0, 0.0]), np.array([0.01, 0.0, 0.0])
    assert [stages.choose(r) for r in (far, near, far)] == ["force", "moment", "moment"]
    stages = residuals.Sequential(0.05, fallback=True)
    assert [stages.choose(r) for r in (far, near, far)] == ["force", "moment", "force"]


@settings(deadline=None)
@given(seeds, st.sampled_from(["averaged", "renormalised", "physical"]))
def test_virtual_contacts_of_one_are_the_contacts(seed: int, variant: virtual.Variant) -> None:
    """A virtual contact with one member is that member."""
    n, x = _contacts(seed, 3)
    alone = ((0,), (1,), (2,))
    np.testing.assert_allclose(
        virtual.displacements(n, x, alone, variant=variant), residuals.displacements(n, x)
    )


def test_averaged_normals_leave_a_residual() -> None:
    """Around a cylinder a pair at +-23 degrees opposes one finger: only renormalised is it zero."""
    a = np.array([0.0, np.pi - 0.4014, np.pi + 0.4014])
    n = -np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    sizes = {
        v: np.linalg.norm(virtual.residuals(n, -0.05 * n, virtual.PAIR, variant=v)[0])
        for v in ("averaged", "renormalised", "physical")
    }
    assert sizes["averaged"] == pytest.approx(0.08, abs=0.002)
    assert sizes["renormalised"] < 1e-12
    assert sizes["physical"] < 1e-12


def test_a_skew_pair_is_seen_by_the_physical_moment_only() -> None:
    """Two members whose forces twist the object: averaging their places and normals hides it."""
    n = np.array([[1.0, 0.0, 0.0], [-0.9, 0.0, 0.436], [-0.9, 0.0, -0.436]])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    x = np.array([[-0.05, 0.0, 0.0], [0.05, 0.02, 0.0], [0.05, -0.02, 0.0]])
    hidden = virtual.residuals(n, x, virtual.PAIR, variant="renormalised")[1]
    seen = virtual.residuals(n, x, virtual.PAIR, variant="physical")[1]
    assert np.linalg.norm(hidden) < 1e-12
    assert np.linalg.norm(seen) > 0.1


@settings(deadline=None)
@given(seeds)
def test_rotation_without_gravity_is_zero(seed: int) -> None:
    """If gravity is not among the sensor's contacts, the rotation form has no gradient (4.41)."""
    n, x = _contacts(seed, 3)
    assert np.abs(gravity.rotation(n, x, None)).max() < 1e-12


@settings(max_examples=15, deadline=None)
@given(seeds)
def test_rotation_turns_against_gravity(seed: int) -> None:
    """From sideways on, one contact turns up under the object, the centre of mass over it."""
    rng = np.random.default_rng(seed)
    n, x = _contacts(seed, 1)
    n[0, 2] = abs(n[0, 2])  # hanging is a minimum of the moment, which the sum may stay at
    centre = x + 0.05 * n + rng.uniform(-0.01, 0.01, 3)
    for _ in range(300):
        turn = gravity.rotation(n, x, centre[0], alpha=0.1)
        angle = np.linalg.norm(turn)
        if angle > 0.0:
            axis = turn / angle

            def about(
                v: np.ndarray, axis: np.ndarray = axis, a: float = float(angle)
            ) -> np.ndarray:
                along = (v @ axis)[:, None] * axis
                return along + np.cos(a) * (v - along) + np.sin(a) * np.cross(axis, v)

            n, centre = about(n), x + about(centre - x)
    net, moment = residuals.residuals(*gravity.with_gravity(n, x, centre[0]))
    descended = np.linalg.norm(net) ** 2 + np.linalg.norm(moment) ** 2
    assert descended < 0.2  # the rest is the centre's offset, which no rotation takes away


def test_gravity_is_sensed_but_not_moved() -> None:
    """A platform grasp: a single contact slides until it is under the object."""
    n = np.array([[0.6, 0.0, 0.8]])
    for _ in range(300):
        n = n - gravity.displacements(n, -0.05 * n, np.zeros(3)) / 0.05
        n /= np.linalg.norm(n)
    assert n[0, 2] > 0.999


def test_curvature_is_found_from_sliding() -> None:
    """A contact that slides both ways over an ellipsoid's end learns its two curvatures."""
    feeler, a = curvature.Curvature(memory=0.02), np.array([0.03, 0.05, 0.1])
    for s in np.linspace(0.0, 1.0, 400):
        t = 0.05 * np.array([np.cos(40.0 * s), np.sin(40.0 * s)])
        p = np.array([t[0], t[1], np.sqrt(1.0 - t @ t)])
        n = -p / a
        feeler.feel(n / np.linalg.norm(n), a * p)
    found = np.sort(np.linalg.eigvalsh(feeler.estimate()))
    np.testing.assert_allclose(
        found, np.sort([0.0, 0.1 / 0.03**2, 0.1 / 0.05**2]), rtol=0.15, atol=1
    )


@settings(deadline=None)
@given(seeds)
def test_null_space_of_curvature_is_real(seed: int) -> None:
    """On a known surface the moment's part of a step leaves all of rho as it is."""
    n, x = _contacts(seed, 3)
    rng = np.random.default_rng(seed)
    shapes = []
    for v in n:
        p = np.eye(3) - np.outer(v, v)
        s = rng.normal(size=(3, 3))
        shapes.append(p @ (s @ s.T) @ p * 10.0)
    whole = curvature.displacements(n, x, shapes, damping=1e-6)
    rho, _ = residuals.residuals(n, x)
    moment_part = whole + residuals.ALPHA * residuals.R_C * residuals.force_gradient(n, rho)
    change = sum(-s @ d for s, d in zip(shapes, moment_part, strict=True))
    assert np.linalg.norm(change) < 1e-6


def test_a_probe_takes_a_second_at_least() -> None:
    """Lift, move, touch: a reading a second, and longer for a long way."""
    probing, x, n = Probing(), np.zeros((2, 3)), np.tile([0.0, 0.0, -1.0], (2, 1))
    way = probing.path(x, n, np.array([[0.001, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    assert way[1, 0] == pytest.approx([0.004, 0.0, 0.02])
    assert probing.seconds(x, way, way[2]) >= 1.0
    assert probing.seconds(x, way, x - [0.0, 0.0, 0.2]) > 3.0


def test_what_does_not_fit_is_refused() -> None:
    """Shapes, radius, kind and groups."""
    n = np.eye(3)
    with pytest.raises(ValueError, match="normals and points"):
        residuals.residuals(n, n[:2])
    with pytest.raises(ValueError, match="positive"):
        residuals.residuals(n, n, 0.0)
    with pytest.raises(ValueError, match="unknown kind"):
        residuals.displacements(n, n, kind="best")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="one group"):
        virtual.weights(((0,), (1,)), 3)
