"""The arm's model: published figures, and consistency with finite differences and with DART."""

from __future__ import annotations

import dartpy as dart
import numpy as np
import pytest

from arm.model import STANDING, ArmModel, Base
from deploy.skeleton import ARM, PEN, PLATFORM, load_skeleton
from services.messages import Array

ROBOT = "xr4000_puma560"
PUBLISHED = [
    ((0, np.pi / 4, np.pi, 0, np.pi / 4, 0), (0, 31.6399, 6.0351, 0, 0.0283, 0)),
    ((0, 0, 0, 0, 0, 0), (0, 37.4837, 0.2489, 0, 0, 0)),
]


@pytest.fixture(scope="module")
def model() -> ArmModel:
    """The described arm."""
    return ArmModel(ROBOT)


def random_state(seed: int) -> tuple[Base, Array, Array]:
    """Platform motion, joint positions and rates."""
    rng = np.random.default_rng(seed)
    base = Base(rng.uniform(-2, 2, 3), rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3))
    return base, rng.uniform(-1.5, 1.5, 6), rng.uniform(-1, 1, 6)


@pytest.mark.parametrize(("q", "load"), PUBLISHED)
def test_gravity_load_is_the_published_one(
    model: ArmModel, monkeypatch: pytest.MonkeyPatch, q: tuple[float, ...], load: tuple[float, ...]
) -> None:
    """Without the tool the gravity load is the published one to 4 decimals."""
    _, skeleton = load_skeleton(ROBOT)
    for name in ("pen_holder", "pen"):
        body = skeleton.getBodyNode(name)
        body.setInertia(dart.dynamics.Inertia(1e-12, np.zeros(3), 1e-15 * np.eye(3)))
    monkeypatch.setattr(model, "_skeleton", skeleton)
    monkeypatch.setattr(model, "_pen", skeleton.getBodyNode("pen"))
    model.place(STANDING, np.array(q, dtype=float), np.zeros(6))
    tau = model.torque(model.inertia(), np.zeros(6), np.zeros(6), np.zeros(3))
    np.testing.assert_allclose(tau, load, atol=5e-5)


@pytest.mark.parametrize("seed", range(8))
def test_jacobian_and_drift_are_the_derivative_of_the_pose(model: ArmModel, seed: int) -> None:
    """J qd + drift is the velocity of the tip, linear and angular, on a moving platform."""
    base, q, qd = random_state(seed)
    h = 1e-6
    here = model.place(base, q, qd)
    twist = here.J @ qd + here.drift
    sides = []
    for sign in (-1, 1):
        moved = Base(base.pose + sign * h * base.velocity, base.velocity, base.acceleration)
        sides.append(model.place(moved, q + sign * h * qd, qd))
    before, after = sides
    np.testing.assert_allclose(twist[:3], (after.p - before.p) / (2 * h), atol=1e-7)
    W = (after.R - before.R) / (2 * h) @ here.R.T
    np.testing.assert_allclose(twist[3:], [W[2, 1], W[0, 2], W[1, 0]], atol=1e-7)


@pytest.mark.parametrize("seed", range(8))
def test_torque_gives_the_acceleration_it_was_asked_for(model: ArmModel, seed: int) -> None:
    """DART's forward dynamics answers the model's torque with the wanted acceleration."""
    base, q, qd = random_state(seed)
    rng = np.random.default_rng(100 + seed)
    wanted = rng.uniform(-5, 5, 6)
    model.place(base, q, qd)
    tau = model.torque(model.inertia(), wanted, np.zeros(6), base.acceleration)
    _, skeleton = load_skeleton(ROBOT)
    for name in ("platform_x", "platform_y", "platform_heading", "pen_spring"):
        skeleton.getJoint(name).setActuatorType(dart.dynamics.ActuatorType.ACCELERATION)
    positions, velocities, commands = (
        np.zeros(skeleton.getNumDofs()),
        np.zeros(skeleton.getNumDofs()),
        np.zeros(skeleton.getNumDofs()),
    )
    positions[PLATFORM], positions[ARM] = base.pose, q
    velocities[PLATFORM], velocities[ARM] = base.velocity, qd
    commands[PLATFORM], commands[ARM] = base.acceleration, tau
    skeleton.setPositions(positions)
    skeleton.setVelocities(velocities)
    skeleton.setCommands(commands)
    skeleton.computeForwardDynamics()
    got = skeleton.getAccelerations()
    np.testing.assert_allclose(got[PLATFORM], base.acceleration, atol=1e-9)
    assert got[PEN] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(got[ARM], wanted, atol=1e-6)


def test_base_motion_runs_on_with_its_acceleration() -> None:
    """``after`` is the exact motion under constant acceleration, and composes."""
    base, _, _ = random_state(5)
    late = base.after(0.2).after(0.3)
    np.testing.assert_allclose(late.velocity, base.velocity + 0.5 * base.acceleration)
    np.testing.assert_allclose(
        late.pose, base.pose + 0.5 * base.velocity + 0.125 * base.acceleration
    )


def test_stretch_does_not_depend_on_where_the_platform_is(model: ArmModel) -> None:
    """The reach is counted from the arm's own shoulder, and is longest with a straight arm."""
    base, q, qd = random_state(2)
    model.place(STANDING, q, qd)
    here = model.stretch()
    model.place(base, q, qd)
    assert model.stretch() == pytest.approx(here, abs=1e-12)
    model.place(STANDING, np.array([0.0, 0.0, -np.pi / 2 + 0.047, 0.0, 0.0, 0.0]), qd)
    assert here < model.stretch() < 0.89
    assert model.stretch() > 0.86


def test_joint_margin_is_negative_beyond_a_limit(model: ArmModel) -> None:
    """The margin is the distance to the nearest limit, and its sign tells the side."""
    q = 0.5 * (model.q_lower + model.q_upper)
    q[4] = model.q_upper[4] - 0.03
    assert model.joint_margin(q) == pytest.approx(0.03)
    q[1] = model.q_lower[1] - 0.01
    assert model.joint_margin(q) == pytest.approx(-0.01)


@pytest.mark.parametrize("seed", range(4))
def test_feedback_is_what_the_joints_get_on_a_platform_that_recoils(
    model: ArmModel, seed: int
) -> None:
    """Added feedback torque adds just that joint acceleration when nothing holds the platform."""
    base, q, qd = random_state(seed)
    feedback = np.random.default_rng(200 + seed).uniform(-5, 5, 6)
    model.place(base, q, qd)
    without = model.torque(model.inertia(), np.zeros(6), np.zeros(6), base.acceleration)
    with_it = model.torque(model.inertia(), np.zeros(6), feedback, base.acceleration)
    _, skeleton = load_skeleton(ROBOT)
    skeleton.getJoint("pen_spring").setActuatorType(dart.dynamics.ActuatorType.ACCELERATION)
    positions, velocities = np.zeros(skeleton.getNumDofs()), np.zeros(skeleton.getNumDofs())
    positions[PLATFORM], positions[ARM] = base.pose, q
    velocities[PLATFORM], velocities[ARM] = base.velocity, qd
    got = []
    for tau in (without, with_it):
        skeleton.setPositions(positions)
        skeleton.setVelocities(velocities)
        commands = np.zeros(skeleton.getNumDofs())
        commands[ARM] = tau
        skeleton.setCommands(commands)
        skeleton.computeForwardDynamics()
        got.append(skeleton.getAccelerations()[ARM])
    np.testing.assert_allclose(got[1] - got[0], feedback, rtol=1e-6, atol=1e-6)
