"""Controllers of the grasp, their composition, goal regions and programs."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from arm.control.priority import priorities
from arm.grasping.above import Above, below
from arm.grasping.feel import Feel
from arm.grasping.glide import Glide
from arm.grasping.hands import Hands, written
from arm.grasping.law import Law
from arm.grasping.model import JOINTS, TwoArmModel
from arm.grasping.nodes import REGISTRY
from arm.grasping.nodes.drive_to_box import DriveToBox
from arm.grasping.nodes.pressing import press
from arm.grasping.nodes.set_down import GraspSetDown
from arm.grasping.regions import NAMES, Edges, Regions
from arm.grasping.scene import BoxPlace, Faces, Scene
from arm.hds import load
from arm.joint_limits import JointLimits
from arm.model import STANDING

PROGRAMS = Path(__file__).parents[2] / "arm" / "programs"
PAGE = Path(__file__).parents[2] / "docs" / "move_to_grasp.md"
SIZE = np.array([0.203, 0.279, 0.178])
MODEL = TwoArmModel("rmp_two_arms")


def scene(x: float = 0.6, y: float = 0.0, force: float = 0.0) -> Scene:
    """The arms at rest, a box in front of them, both palms pressed with a force."""
    q = np.array(MODEL.robot.arms.rest)
    feel = Feel()
    wrench = np.zeros(12)
    wrench[1], wrench[7] = force, -force
    for _ in range(200):
        feel.step(wrench, 0.004)
    box = BoxPlace(np.array([x, y, 0.839]), np.eye(3), np.zeros(3), SIZE, np.zeros(4))
    palms = MODEL.place(q, np.zeros(JOINTS))
    return Scene(0.004, 1.0, palms, feel, STANDING, box, 0.0, SIZE, np.array([0.04, 0.01, 0.055]))


def hands() -> Hands:
    """Of the robot."""
    robot = MODEL.robot
    ends = MODEL.q_lower, MODEL.q_upper
    return Hands(np.array(robot.arms.rest), *ends, robot.palms.pad.stiffness)


def test_the_parallel_controller_is_derived_as_in_the_paper() -> None:
    """Eq 8 to 11: names replaced, parentheses dropped, the right-most of duplicates kept."""
    assert written(hands().parallel) == [
        "comply / gm / reach",
        "moment / force / reach / (force / reach) / reach",
        "moment / force / reach / force / reach / reach",
        "moment / force / reach",
    ]


def test_pressing_does_not_move_the_palms_off_the_line() -> None:
    """Rows of the reach are met exactly, whatever the force asks for below them."""
    ours, seen = hands(), scene()
    anything: Any = seen
    rows = [o.rows(anything, 0.004) for o in ours.gm.parts()]
    reach = rows[0]
    qd = priorities(rows, JOINTS).qd
    assert reach.J @ qd == pytest.approx(reach.rate, abs=1e-9)
    assert np.abs(rows[1].J @ qd - rows[1].rate).max() < 1e-9


def test_palms_that_touch_before_the_line_press_lightly_and_go_on_to_it() -> None:
    """With a grip's wide dead zone they would stay outside the goal region for good."""
    h = hands()
    press(h, 25.0, scene(force=30.0), on_line=False)
    assert h.force.goal == h.force.LIGHT
    assert h.reach.dead < Edges().line[0]


def test_a_box_turned_at_arm_s_length_is_out_of_the_approach() -> None:
    """The palm on its farther side holds it with a joint at its end, and cannot lift it."""
    regions, far = Regions(), scene(0.69)
    regions.step(scene(0.60), held=False)
    regions.step(far, held=False)
    assert regions["approach"]
    assert far.box is not None
    R = Rotation.from_rotvec([0.0, 0.0, 0.28]).as_matrix()  # by itself within its edge
    regions.step(replace(far, box=replace(far.box, R=R)), held=False)
    assert not regions["approach"]


def test_while_the_force_rises_palms_go_on_by_what_their_pads_give_way() -> None:
    """Held still instead, they would be turned onto an edge; at the goal they stand."""
    h, seen = hands(), scene(force=25.0)
    anything: Any = seen
    rates = [h.force.rows(anything, 0.004).rate for _ in range(100)]
    lag = h.force.DAMPING * 20.0  # the reference is still below what is felt
    assert rates[0] == pytest.approx(h.force.RAMP / 5000.0 - lag, abs=1e-3)
    assert np.abs(rates[-1]).max() < 1e-3


def test_goal_regions_nest_and_have_a_wider_way_out() -> None:
    """To be in one is to be in all before it; 0.69 m is in only for who was nearer before."""
    regions = Regions()
    regions.step(scene(0.69), held=False)
    assert not regions["approach"]
    regions.step(scene(0.60), held=False)
    assert regions["approach"] and not regions["reach"]
    regions.step(scene(0.69), held=False)
    assert regions["approach"]
    pressed = scene(0.60, force=25.0)
    assert pressed.box is not None
    middle = 0.5 * (pressed.palms.p[0] + pressed.palms.p[1])
    regions.step(replace(pressed, box=replace(pressed.box, p=middle)), held=True)
    assert all(regions[name] for name in NAMES)
    regions.step(replace(pressed, box=None), held=False)
    assert not any(regions[name] for name in NAMES)


@pytest.mark.parametrize(
    "name",
    [
        "move_to_grasp",
        "move_to_grasp_parallel",
        "grasp_refine",
        "grasp_funnel",
        "grasp_parallel",
        "grasp_sum",
    ],
)
def test_programs_have_no_findings(name: str) -> None:
    """Checked as they come."""
    assert load(PROGRAMS / f"{name}.hds", REGISTRY).warnings == ()


def test_the_refining_program_looks_back_and_the_funnel_does_not() -> None:
    """Every controller but the first falls back to the region that was left, the earliest first."""
    refine = load(PROGRAMS / "grasp_refine.hds", REGISTRY)
    looks = [guard.quantity for guard in refine.node("Comply").guards]
    assert looks == ["In_approach", "In_reach", "In_contact"]
    assert "Touching" in [guard.quantity for guard in refine.node("Lift").guards]
    funnel = load(PROGRAMS / "grasp_funnel.hds", REGISTRY)
    assert not any(
        guard.quantity.startswith("In_") for node in funnel.nodes.values() for guard in node.guards
    )


def test_a_palm_pushed_too_hard_gives_way_before_anything_else() -> None:
    """Both palms pressed with 90 N move out, though the force objective asks for more."""
    ours, seen = hands(), scene(force=90.0)
    anything: Any = seen
    rows = [ours.yields.rows(anything, 0.004), ours.force.rows(anything, 0.004)]
    qd = priorities(rows, JOINTS).qd
    assert seen.box is not None
    out = [float(s * seen.box.across @ seen.palms.J[i][:3] @ qd) for i, s in enumerate((1, -1))]
    assert min(out) > 0.5


def test_a_glide_arrives_in_its_time_at_the_speed_asked_for_with_the_least_jerk() -> None:
    """From rest over 0.3 m in 1 s: there, at 0.08 m/s; at rest, jerk is 720 L^2/T^5 in all."""
    dt, way = 0.001, 0.3
    for end in (0.0, 0.08):
        glide = Glide((1,), fastest=1.0, soonest=0.02)
        glide.begin(1.0)
        path = [0.0]
        for _ in range(1000):
            left = max(way - path[-1], glide.servo(end))
            path.append(path[-1] + dt * float(glide.step([left], dt, end)[0]))
        assert path[-1] == pytest.approx(way, abs=0.002)
        assert glide.speed[0] == pytest.approx(end, abs=0.01)
        if end == 0.0:
            jerk = np.diff(np.array(path), 3) / dt**3
            assert np.sum(jerk[:900] ** 2) * dt < 1.05 * 720.0 * way**2


def test_a_disturbed_glide_is_stretched_and_still_arrives() -> None:
    """Pushed 0.2 m off when it was nearly there: no faster than a little above ``fastest``."""
    glide = Glide((1,), fastest=0.5)
    way, speeds = 0.2, []
    for _ in range(500):
        speeds.append(float(glide.step([way], 0.004)[0]))
        way -= 0.004 * speeds[-1]
    assert max(speeds) < 1.3 * 0.5
    assert abs(way) < 0.001


def test_a_box_turned_on_its_table_is_taken_by_the_face_that_looks_where_its_front_did() -> None:
    """At most 45 degrees off, its width across; near the corner the face stays what it was."""
    faces = Faces()
    away = np.array([0.6, 0.0, 0.0])
    shown = []
    for yaw in np.radians(np.arange(0.0, 361.0, 5.0)):
        R = Rotation.from_euler("z", yaw).as_matrix()
        faces.choose(R, away, free=True)
        turned = R @ faces.turn
        shown.append(np.degrees(np.arctan2(turned[1, 0], turned[0, 0])))
        wide, deep = (0.203, 0.279) if abs(turned[:, 1] @ R[:, 0]) > 0.5 else (0.279, 0.203)
        assert faces.size(SIZE) == pytest.approx([deep, wide, 0.178])
    assert max(shown) < 45.0 + np.degrees(Faces.FIRM) < max(shown) + 5.0
    assert min(shown) > -45.0
    assert shown[0] == pytest.approx(shown[-1])


def test_where_the_robot_comes_from_does_not_change_the_face() -> None:
    """Beside a long table the nearer face is not the one that can be reached."""
    faces = Faces()
    for bearing in (0.0, 1.0, 1.4):
        away = np.array([np.cos(bearing), np.sin(bearing), 0.0])
        faces.choose(np.eye(3), away, free=True)
        assert (faces.turn == np.eye(3)).all()


def test_palms_on_the_box_do_not_change_faces() -> None:
    """Held by one pair of faces, a box that turns is not believed to have turned back."""
    faces = Faces()
    away = np.array([0.6, 0.0, 0.0])
    faces.choose(np.eye(3), away, free=True)
    turned = Rotation.from_euler("z", 1.2).as_matrix()
    faces.choose(turned, away, free=False)
    assert (faces.turn == np.eye(3)).all()
    faces.choose(turned, away, free=True)
    assert (faces.turn != np.eye(3)).any()


def test_a_palm_that_shakes_is_not_pushed_and_one_that_is_hit_is_at_once() -> None:
    """The cell feels the palm's inertia: giving way to that kept it shaking for good."""
    feel = Feel()
    wrench, force = np.zeros(12), 60.0
    wrench[1] = force
    feel.step(wrench, 0.004)
    assert feel.pushed[0] == pytest.approx([0.0, force, 0.0])
    for k in range(1, 12):
        wrench[1] = force * np.cos(0.5 * np.pi * k)  # four ticks a period
        feel.step(wrench, 0.004)
        assert np.linalg.norm(feel.pushed[0]) < 1e-6
    wrench[1] = force
    for _ in range(6):
        feel.step(wrench, 0.004)
    assert feel.pushed[0] == pytest.approx([0.0, force, 0.0])


def test_what_is_below_a_palm_is_the_box_only_over_it() -> None:
    """Beside it and within its height a palm is over the table."""
    seen = scene()
    assert seen.box is not None
    box, half = seen.box, seen.half_palm
    top = float(box.p[2]) + 0.089
    assert below(box, box.p + [0.0, 0.0, 0.2], half) == pytest.approx(top)
    assert below(box, box.p + [0.0, 0.14, 0.2], half) == pytest.approx(top)
    assert below(box, box.p + [0.0, 0.16, 0.2], half) == pytest.approx(top - 0.178)
    assert below(box, box.p + [0.0, 0.14, 0.0], half) == pytest.approx(top - 0.178)


def test_a_turned_box_is_come_at_a_little_off_the_square() -> None:
    """Towards where the way was free, by 0.3 rad at most; one as it was first seen, square on."""
    seen = scene()
    assert seen.box is not None
    ahead = np.array([1.0, 0.0, 0.0])
    for yaw, heading in ((0.0, 0.0), (0.15, 0.15), (0.4, 0.2), (0.78, 0.48), (-0.78, -0.48)):
        R = Rotation.from_euler("z", yaw).as_matrix()
        box = replace(seen.box, R=R, ahead=ahead)
        assert box.approach == pytest.approx(heading, abs=1e-6)


def test_palms_keep_off_the_table_by_what_is_known_of_its_height() -> None:
    """15 mm and two deviations of the box's height; further up nothing is asked for."""
    seen = scene()
    assert seen.box is not None
    lowest = min(
        float(p[2] - np.abs(R[2]) @ seen.half_palm)
        for p, R in zip(seen.palms.p, seen.palms.R, strict=True)
    )
    for sd, clear, asked in ((0.0, 0.016, False), (0.0, 0.014, True), (0.01, 0.034, True)):
        p = np.array([2.0, 0.0, lowest - clear + 0.5 * SIZE[2]])
        box = replace(seen.box, p=p, sd=np.array([0.0, 0.0, sd, 0.0]))
        anything: Any = replace(seen, box=box)
        rows = Above().rows(anything, 0.004)
        assert (len(rows.J) > 0) == asked
        assert (rows.rate > 0.0).all()


def test_the_page_states_the_edges_of_the_regions() -> None:
    """Its table has every edge, as it is for those who come and for those who are in."""
    e = Edges()
    near = (e.distance, e.nearest, e.aside, e.facing, e.farthest)
    mm = tuple(1000.0 * edge for edge in e.line)
    stated = {"approach": near, "reach": (mm,), "contact": (e.force,), "comply": (e.moment,)}
    assert tuple(stated) == NAMES
    assert sum(map(len, stated.values())) == len(fields(e))
    for name, edges in stated.items():
        (row,) = re.findall(rf"^\| {name} \|(.+)\|(.+)\|$", PAGE.read_text("utf-8"), re.M)
        for cell, figures in zip(row, zip(*edges, strict=True), strict=True):
            read = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", cell)]
            assert read == pytest.approx(figures), name


def test_the_arm_does_not_wait_for_its_wrist() -> None:
    """Asked for 2 rad/s of the wrist, the shoulder has its 0.5 rad/s as soon as by itself."""
    limits = JointLimits(["j"] * 14, MODEL.q_lower, MODEL.q_upper, [5.0] * 14)
    q = np.array(MODEL.robot.arms.rest)
    MODEL.place(q, np.zeros(JOINTS))
    reached = []
    for wrist in (0.0, 2.0):
        law, wanted = Law(MODEL), np.zeros(JOINTS)
        wanted[0], wanted[5] = 0.5, wrist
        for _ in range(16):
            law.torque(0.004, wanted, np.zeros(JOINTS), np.zeros(JOINTS), True, limits.ends(q))
        reached.append(law.reference[0])
    assert reached[1] == pytest.approx(reached[0], rel=0.05)


def test_back_is_where_the_platform_looks_once_a_push_no_longer_turns_it() -> None:
    """Until it has come to rest it is sent nowhere; then straight back."""
    values = {"Side": "back", "Distance": 1.0, "Tolerance": 0.06, "Timeout": 20.0}
    node = DriveToBox(values)
    seen, h, regions = scene(), hands(), Regions()
    turning = replace(STANDING, pose=np.array([0.0, 0.0, 0.2]), velocity=np.array([0.0, 0.0, 0.5]))
    node.enter(replace(seen, base=turning), h, regions)
    assert node.update(replace(seen, base=turning), h, regions).goal is None
    rests = replace(STANDING, pose=np.array([0.0, 0.0, 0.4]))
    goal = node.update(replace(seen, base=rests), h, regions).goal
    assert goal is not None
    assert goal == pytest.approx([-0.4 * np.cos(0.4), -0.4 * np.sin(0.4), 0.4])


@pytest.mark.parametrize(("left", "event"), [(20.0, "No_table"), (3.0, "Down")])
def test_a_box_that_nothing_carries_is_not_said_to_stand(left: float, event: str) -> None:
    """Lowered until the load is gone from the palms, or as far as a table can be."""
    node = GraspSetDown({"Speed": 0.08, "Grip": 45.0, "Timeout": 10.0})
    own, regions, heavy = hands(), Regions(), scene()

    def weighing(newtons: float) -> Scene:
        """Half of it on each palm, whose frame is turned."""
        heavy.feel.load = np.array([R.T @ [0.0, 0.0, -0.5 * newtons] for R in heavy.palms.R])
        return heavy

    node.enter(weighing(20.0), own, regions)
    own.carry.height = 0.05
    said = None
    for _ in range(2500):
        now = weighing(left if own.carry.height < -0.01 else 20.0)
        said = node.update(now, own, regions).event
        if said:
            break
    assert said == event
    assert (own.carry.height < -0.05) == (event == "No_table")
