"""The world of a hand on an arm: coupled joints, load cells, objects."""

from __future__ import annotations

import numpy as np
import pytest

from arm.hand import friction
from arm.hand.law import Law
from arm.hand.model import HandModel
from deploy.robot import HandRobot, MobileBase, load_robot
from deploy.skeleton import hand_coupling, load_hand_skeleton
from sim.hand_objects import THINGS
from sim.hand_world import HandMismatch, HandWorld, Setting

ROBOT = "platform_hand"
QUIET = HandMismatch(bias=0.0)


def world(**setting: object) -> HandWorld:
    """A world whose load cells have no bias, by default with an empty table."""
    made = Setting(**{"thing": None, "mismatch": QUIET, **setting})  # type: ignore[arg-type]
    return HandWorld(ROBOT, made, np.random.default_rng(0))


def rest(robot: HandRobot) -> np.ndarray:
    """Driven joints of the arm at rest with an open hand."""
    return np.array([*robot.arm.rest, 1.05, 0.65, 0.65, 0.65])


def test_a_hand_is_a_mobile_base_whose_description_says_what_follows_what() -> None:
    """Eleven drives move fifteen joints; the platform is nobody's follower."""
    robot = load_robot(ROBOT, MobileBase)
    assert isinstance(robot, HandRobot)
    leaders, S = hand_coupling(*load_hand_skeleton(ROBOT))
    assert S.shape == (18, 11)
    assert np.allclose(S[leaders], np.eye(11))
    assert np.count_nonzero(S[:3]) == 0
    assert sorted(S[S > 0.0])[:3] == pytest.approx([1 / 3] * 3)


def test_followers_go_along_with_their_leaders_under_torque() -> None:
    """The world couples joints as the description says."""
    w = world()
    q = rest(w.robot)
    w.put(q)
    model, law = HandModel(ROBOT), Law(HandModel(ROBOT))
    goal = q + np.array([0.0] * 7 + [0.2, 0.3, 0.1, -0.2])
    still, free = np.zeros(11), np.zeros(11, dtype=bool)
    for _ in range(500):
        w.step(law.follow(model.place(w.q, w.qd), goal, still, free, np.zeros((3, 3))))
    assert np.abs(w.q - goal).max() < 0.01
    everything = np.asarray(w._skeleton.getPositions())
    assert np.abs(everything - w._S @ w.q).max() < 2e-3


def test_a_resting_hand_reads_no_force_but_bias_and_noise() -> None:
    """The weight of the tips is taken out."""
    w = world()
    w.put(rest(w.robot))
    model, law = HandModel(ROBOT), Law(HandModel(ROBOT))
    still, free = np.zeros(11), np.zeros(11, dtype=bool)
    for _ in range(300):
        at = model.place(w.q, w.qd)
        w.step(law.follow(at, rest(w.robot), still, free, np.zeros((3, 3))))
    cells = np.mean([w.cells() for _ in range(400)], axis=0)
    assert np.abs(cells[:, :3]).max() < 0.03
    assert np.abs(cells[:, 3:]).max() < 3e-4


def test_a_dead_cell_reads_a_constant() -> None:
    """While the others go on reading noise."""
    w = world(dead=1)
    w.put(rest(w.robot))
    w.step(np.zeros(11))
    readings = np.array([w.cells() for _ in range(5)])
    assert np.ptp(readings[:, 1]) == 0.0
    assert np.ptp(readings[:, 0]) > 0.0


@pytest.mark.parametrize("thing", list(THINGS))
def test_every_object_stands_still_by_itself(thing: str) -> None:
    """Free objects neither sink, tip nor creep."""
    w = world(thing=thing, fixed=False, friction=0.5)
    w.put(rest(w.robot))
    p = w.object()[1].copy()
    model, law = HandModel(ROBOT), Law(HandModel(ROBOT))
    still, free = np.zeros(11), np.zeros(11, dtype=bool)
    for _ in range(500):
        at = model.place(w.q, w.qd)
        w.step(law.follow(at, rest(w.robot), still, free, np.zeros((3, 3))))
    R, now = w.object()
    assert np.linalg.norm(now - p) < 1e-3
    assert R[2, 2] > 0.9999


@pytest.mark.parametrize(("rate", "arrives"), [(friction.RATE, True), (0.0, False)])
def test_two_wrist_axes_in_line_get_where_they_are_to_be_over_friction(
    rate: float, arrives: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against each other they turn hardly any inertia; a fifth of their friction is not known."""
    monkeypatch.setattr(friction, "RATE", rate)
    w = world(arm_friction=True, mismatch=HandMismatch(friction=0.0))
    start = rest(w.robot)
    start[5] = 0.02
    goal = start + np.eye(11)[4] * 0.05 - np.eye(11)[6] * 0.05
    w.put(start)
    model = HandModel(ROBOT)
    law = Law(model, friction=(0.8, 0.0))
    still, free = np.zeros(11), np.zeros(11, dtype=bool)
    for _ in range(1500):
        at = model.place(w.q, w.qd)
        law.friction.see(0.001, at, np.zeros((3, 3)))
        tau = law.follow(at, goal, still, free, np.zeros((3, 3)))
        law.friction.sent(tau)
        w.step(tau)
    assert (np.abs(w.q - goal).max() < 0.02) == arrives


def test_what_a_joint_is_not_told_of_its_friction_shows_in_its_motion() -> None:
    """A fifth of the friction of a joint that turns steadily, to a tenth of that."""
    w = world(arm_friction=True, mismatch=HandMismatch(friction=0.0))
    q = rest(w.robot)
    w.put(q)
    model = HandModel(ROBOT)
    law = Law(model, friction=(0.8, 0.0))
    rate, free = 0.2 * np.eye(11)[1], np.zeros(11, dtype=bool)
    for step in range(1000):
        law.friction.see(0.001, model.place(w.q, w.qd), np.zeros((3, 3)))
        at = model.place(w.q, w.qd)
        tau = law.follow(at, q + 0.001 * step * rate, rate, free, np.zeros((3, 3)))
        law.friction.sent(tau)
        w.step(tau)
    assert law.friction._lost[1] == pytest.approx(0.2 * model.coulomb[1], rel=0.1)
