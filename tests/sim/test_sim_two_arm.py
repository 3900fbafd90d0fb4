"""The two-armed robot in its world: arms, wheels, load cells, box and table."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from deploy import robot as descriptions
from deploy.robot import MobileBase, Robot, TwoArmRobot, load_robot, robot_kind
from deploy.skeleton import BOTH, LEFT, RIGHT, load_two_arm_skeleton
from deploy.tomlfile import BadFile
from services.lockstep import Lockstep
from services.messages import ArmCommand, ArmState, Array, Imu, Odometry, Truth, Vision
from services.service import Inbox, Outbox
from services.sim_service import SimService
from services.topics import ARM_COMMAND, ARM_STATE, BASE_COMMAND
from sim.scenario import Box, Start, World, load_scenario
from sim.start import start_pose
from sim.two_arm_simulator import TwoArmSimulator
from tests.sim.two_arm_loop import ROBOT, Holder, Squeezer, run, scenario

REST = np.array(load_robot(ROBOT, TwoArmRobot).arms.rest)


# --- the description ------------------------------------------------------------------------


def test_a_robot_loads_as_what_it_is_and_not_as_another_kind() -> None:
    """Whoever needs one kind is told which robot is of another."""
    assert (robot_kind(ROBOT), robot_kind("xr4000_puma560")) == ("two_arm", "one_arm")
    assert isinstance(load_robot(ROBOT, MobileBase), TwoArmRobot)
    assert isinstance(load_robot("xr4000_puma560", MobileBase), Robot)
    with pytest.raises(BadFile, match="of kind 'two_arm'; this needs 'one_arm'"):
        load_robot(ROBOT)
    with pytest.raises(BadFile, match="this needs 'two_arm'"):
        load_robot("xr4000_puma560", TwoArmRobot)


def test_an_unknown_kind_is_refused_with_the_known_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The error lists what is valid."""
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / "robot.toml").write_text('kind = "three_arm"')
    monkeypatch.setattr(descriptions, "ROBOTS", tmp_path)
    with pytest.raises(BadFile, match=r"no kind 'three_arm'. Known: one_arm, two_arm"):
        load_robot("odd")


def test_arms_are_mirror_images_and_palms_face_each_other() -> None:
    """At rest the palms are level with the middle of the box, fingertips ahead."""
    robot, skeleton = load_two_arm_skeleton(ROBOT)
    assert [skeleton.getDof(i).getName() for i in range(3, 17)] == list(robot.arms.joints)
    q = np.zeros(17)
    q[LEFT], q[RIGHT] = robot.arms.rest_left, robot.arms.rest_right
    skeleton.setPositions(q)
    left, right = (skeleton.getBodyNode(link).getWorldTransform() for link in robot.palms.links)
    p = np.asarray(left.translation()).reshape(3)
    np.testing.assert_allclose(p, [0.337, 0.270, 0.836], atol=1e-3)
    mirrored = np.asarray(right.translation()).reshape(3) * [1, -1, 1]
    np.testing.assert_allclose(mirrored, p, atol=1e-12)
    for palm in (left, right):
        R = np.asarray(palm.rotation())
        assert R[1, 1] > 0.99  # the normal is across
        assert R[0, 2] < -0.99  # from fingertips to heel is backwards
    assert skeleton.getMass() == pytest.approx(139.4, abs=0.1)


# --- standing, holding, sensing -------------------------------------------------------------


class Hold:
    """The arms' process, as far as this test needs one."""

    name, period, verbs, inputs = "arm", 0.001, (), (ARM_STATE,)

    def __init__(self, torques: int = 14) -> None:
        self._hold, self._torques, self._t = Holder(), torques, -1.0

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Answer a new state."""
        state = inbox.latest(ARM_STATE)
        if state is None or state.t <= self._t:
            return []
        self._t = state.t
        command = self._hold(state)
        return [(ARM_COMMAND, ArmCommand(command.t, command.tau[: self._torques]))]

    def prepare(self, verb: str, args: dict[str, Any]) -> Any:
        """Nothing."""
        raise ValueError(verb)

    def state(self) -> tuple[str, str]:
        """Always well."""
        return "running", ""


def test_in_lockstep_it_stands_holds_and_senses_while_the_box_rests() -> None:
    """For 5 s nothing moves, every sensor speaks at its rate, and torques are a period old."""
    heard: list[tuple[str, Any, float]] = []
    scenario_ = load_scenario("move_to_grasp")
    world = Lockstep(
        [SimService(scenario_, 3), Hold()],
        listener=lambda topic, message, at: heard.append((topic.name, message, at)),
    )
    while world.now < 5.0:
        world.step()
    of = {name: [m for n, m, _ in heard if n == name] for name in {n for n, _, _ in heard}}
    states, truths = of["robot/arm_state"], of["sim/truth"]
    assert len(states) == 1250
    assert max(np.abs(s.q - REST).max() for s in states) < 2e-3
    for name, rate in (("odometry", 25), ("imu", 125)):
        assert len(of[f"robot/{name}"]) == pytest.approx(5 * rate, abs=2)
    late = {round(at - m.t, 3) for n, m, at in heard if n == "robot/vision"}
    assert late <= {0.028}  # 25 ms, at the next multiple of 4 ms
    np.testing.assert_allclose(truths[-1].bodies["box"][:3], [0, 0, 0.839], atol=1e-4)
    np.testing.assert_allclose(truths[-1].pose, truths[0].pose, atol=1e-9)
    assert of["arm/command"][-1].tau.shape == (14,)


def test_torques_for_another_robot_are_silence() -> None:
    """Six torques do not move 14 joints: the brakes hold, and the state says why."""
    sim = SimService(load_scenario("move_to_grasp"), 1)
    inbox = Inbox((ARM_COMMAND, BASE_COMMAND))
    for k in range(25):
        inbox.offer(ARM_COMMAND, ArmCommand(k * 0.004, np.full(6, 50.0)))
        out = sim.step(k * 0.004, inbox)
    state = next(m for _, m in out if isinstance(m, ArmState))
    np.testing.assert_allclose(state.q, REST, atol=1e-4)
    assert sim.state()[1] == "refused a command of 6 torques, not 14"


def test_silent_arms_are_held_by_their_brakes() -> None:
    """Without torques for 50 ms the posture stays, and it did not before that."""
    seen = run(scenario(), 1.0, arms=lambda s: Holder()(s) if s.t < 0.3 else None)
    q = np.array([s.q for s in seen.of(ArmState)])
    np.testing.assert_allclose(q[-1], q[100], atol=1e-5)


def test_equal_seeds_give_equal_runs_and_others_do_not() -> None:
    """Every message of two runs is the same, bit for bit."""

    def said(seed: int) -> list[Array]:
        made = load_scenario("move_to_grasp")
        seen = run(made, 1.0, lambda t: (0.3, 0.0, 0.2), seed=seed)
        return [s.wrench for s in seen.of(ArmState)] + [o.pose for o in seen.of(Odometry)] + [
            v.p for v in seen.of(Vision)
        ] + [i.accel for i in seen.of(Imu)]  # fmt: skip

    first, again, other = said(5), said(5), said(6)
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[-1], other[-1])


# --- wheels ---------------------------------------------------------------------------------


def test_base_drives_ahead_and_turns_on_the_spot_but_not_sideways() -> None:
    """0.4 m/s and 1 rad/s are its limits, 1 m/s^2 on the way there; vy is not obeyed."""
    ahead = run(scenario(), 2.0, lambda t: (1.0, 0.3, 0.0)).pose
    speed = np.diff(ahead[:, 0]) / 0.004
    assert speed.max() == pytest.approx(0.4, abs=0.005)
    assert (speed[25:] - speed[:-25]).max() / 0.1 == pytest.approx(1.0, abs=0.05)
    assert np.abs(ahead[:, 1]).max() < 1e-6
    turned = run(scenario(), 2.0, lambda t: (0.0, 0.0, 3.0)).pose
    assert (np.diff(turned[:, 2]) / 0.004).max() == pytest.approx(1.0, abs=0.02)
    assert np.abs(turned[:, :2] - turned[0, :2]).max() < 0.01


def test_silent_base_stops() -> None:
    """The last command holds for 0.1 s; after braking it stands exactly still."""
    pose = run(scenario(), 2.0, lambda t: (0.4, 0.0, 0.0) if t < 1.0 else None).pose
    assert np.ptp(pose[400:], axis=0).max() < 1e-9
    assert pose[-1, 0] - pose[250, 0] < 0.16


@pytest.mark.parametrize("direction", [0.0, 90.0])
def test_wheels_hold_a_light_push_and_slide_under_a_strong_one(direction: float) -> None:
    """100 N do not move it; 300 N s slide it by 0.2 to 0.5 m in the direction of the push."""
    moved = []
    for force in (100.0, 3000.0):
        push = {"kind": "push", "t": 0.2, "duration": 0.1, "force": force, "direction": direction}
        pose = run(scenario(push), 1.5).pose
        moved.append(pose[-1, :2] - pose[0, :2])
    toward = np.array([math.cos(math.radians(direction)), math.sin(math.radians(direction))])
    assert np.abs(moved[0]).max() < 1e-9
    assert 0.2 < moved[1] @ toward < 0.5
    assert abs(moved[1] @ [-toward[1], toward[0]]) < 0.02


# --- palms, box, table ----------------------------------------------------------------------


def test_a_push_slides_the_box_as_friction_says() -> None:
    """3 N s at mu = 0.6: J over the push, then v^2 / (2 mu g)."""
    push = {"kind": "push", "t": 0.1, "duration": 0.1, "force": 30.0, "on": "box"}
    boxes = [t.bodies["box"] for t in run(scenario(push), 1.5).of(Truth)]
    a = 30.0 / 1.5 - 0.6 * 9.81
    expected = 0.5 * a * 0.1**2 + (a * 0.1) ** 2 / (2 * 0.6 * 9.81)
    assert boxes[-1][0] == pytest.approx(expected, rel=0.05)
    assert boxes[-1][2] == pytest.approx(0.839, abs=1e-4)


def test_a_push_on_an_arm_moves_that_arm_alone() -> None:
    """The other arm hardly notices; the pushed one comes back."""
    push = {"kind": "push", "t": 0.2, "duration": 0.1, "force": 200.0, "on": "left_link5",
            "direction": 90.0}  # fmt: skip
    truths = run(scenario(push), 1.5).of(Truth)
    off = np.array([t.q - REST for t in truths])
    left, right = np.abs(off[:, :7]).max(), np.abs(off[:, 7:]).max()
    assert left > 0.2 > 10 * right
    assert np.abs(off[-1]).max() < 0.1  # as near as friction lets a spring bring it


def test_two_palms_squeeze_and_lift_the_box_and_the_load_cells_feel_it() -> None:
    """At 26 N a palm the box is lifted by 0.18 m without tipping; each cell reads its share."""
    made = scenario(exact=False, platform_start=(-0.6, 0.0, 0.0))
    seen = run(made, 5.5, arms=Squeezer(np.array([0.6, 0.0, 0.839]), 0.1395, 25.0, 0.2))
    last, state = seen.of(Truth)[-1], seen.of(ArmState)[-1]
    assert last.bodies["box"][2] == pytest.approx(0.839 + 0.185, abs=0.01)
    assert 2 * math.acos(min(1.0, abs(last.bodies["box"][3]))) < math.radians(4.0)
    R, _ = seen.simulator.physics.transform("left_palm")
    np.testing.assert_allclose(R @ state.wrench[:3], last.forces["left_palm"], atol=1.0)
    assert state.wrench[1] > 20.0 and state.wrench[7] < -20.0
    weight = -(last.forces["left_palm"][2] + last.forces["right_palm"][2])
    assert weight == pytest.approx(1.5 * 9.81, abs=0.3)
    assert last.contact and last.force > 20.0


def test_load_cells_do_not_weigh_the_palm_in_any_posture() -> None:
    """Half-way round, they read nothing but the unknown part of the palm's mass."""
    target = REST.copy()
    target[4] = target[11] = 1.2
    seen = run(scenario(), 2.0, arms=Holder(target))
    wrench = np.mean([s.wrench for s in seen.of(ArmState)[-100:]], axis=0)
    assert np.abs(wrench.reshape(2, 6)[:, :3]).max() < 0.05


def test_the_table_stops_the_torso() -> None:
    """Driven at the table, the robot stands before it."""
    seen = run(scenario(platform_start=(-0.7, 0.0, 0.0)), 2.0, lambda t: (0.4, 0.0, 0.0))
    assert seen.pose[-1, 0] == pytest.approx(-0.35 - 0.1, abs=0.01)


def test_a_timeline_that_pushes_what_is_not_there_is_refused() -> None:
    """The error lists what can be pushed."""
    made = scenario({"kind": "push", "t": 0.0, "force": 1.0, "on": "link3"})
    with pytest.raises(ValueError, match=r"no 'link3' here. Known: .*left_palm.*box"):
        TwoArmSimulator(made, 1)
    without = scenario({"kind": "push", "t": 0.0, "force": 1.0, "on": "box"}, box=None)
    with pytest.raises(ValueError, match="no 'box' here"):
        TwoArmSimulator(without, 1)


def test_starts_are_drawn_all_around_the_front_of_the_box() -> None:
    """2 to 2.5 m away, within 1 rad of straight ahead, looking at it within 0.3 rad."""
    box = Box(x=1.0, y=-0.5, yaw=0.7)
    world = World(box=box, start=Start())
    poses = np.array([start_pose(world, np.random.default_rng(s)) for s in range(200)])
    to = np.array([box.x, box.y]) - poses[:, :2]
    distance = np.hypot(*to.T)
    assert 2.0 <= distance.min() < 2.05 and 2.45 < distance.max() <= 2.5
    toward = np.arctan2(to[:, 1], to[:, 0])
    bearing = np.array([math.remainder(a - box.yaw, 2 * math.pi) for a in toward])
    assert -1.0 <= bearing.min() < -0.9 and 0.9 < bearing.max() <= 1.0
    off = [math.remainder(h - a, 2 * math.pi) for h, a in zip(poses[:, 2], toward, strict=True)]
    assert 0.25 < np.abs(off).max() <= 0.3 + 1e-9


def test_a_box_on_its_side_lies_on_the_table() -> None:
    """Its long side is upright, and it stays there."""
    seen = run(scenario(box=Box(on_side=True)), 0.5)
    assert seen.of(Truth)[-1].bodies["box"][2] == pytest.approx(0.75 + 0.1395, abs=1e-3)


def test_joint_slices_cover_both_arms() -> None:
    """Left then right."""
    assert (LEFT.stop, RIGHT.start) == (RIGHT.start, LEFT.stop)
    assert (LEFT.start, RIGHT.stop) == (BOTH.start, BOTH.stop)
