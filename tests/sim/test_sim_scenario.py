"""Scenarios: what ships loads, and what is wrong is named with file, key and allowed values."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from deploy.robot import Equipped, load_robot
from deploy.task import BoardPose
from deploy.tomlfile import BadFile
from sim.disturbance import KINDS, Bias, Push, describe, disturbance_from
from sim.scenario import Scenario, load_scenario, scenario_names
from sim.timeline import Timeline


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenario_loads(name: str) -> None:
    """Every scenario that ships is valid and names a robot that exists."""
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    load_robot(scenario.robot, Equipped)


def test_believed_board_is_the_true_one_by_default() -> None:
    """Unless told otherwise, the controllers believe the truth about the board."""
    scenario = Scenario()
    np.testing.assert_array_equal(scenario.task.board.position(), scenario.world.board.position())
    np.testing.assert_array_equal(scenario.task.board.rotation(), scenario.world.board.rotation())


@pytest.mark.parametrize("yaw", [0.0, 0.4, -1.2, math.pi])
def test_board_frame_is_right_handed_upright_and_faces_the_robot(yaw: float) -> None:
    """S is right-handed, x right and y up for the drawer, z at the robot."""
    R = BoardPose(yaw=yaw).rotation()
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(R[:, 1], [0, 0, 1])
    np.testing.assert_allclose(R[:, 2], [-math.cos(yaw), -math.sin(yaw), 0], atol=1e-12)
    # the drawer looks along -z_S; its right hand is (looking direction) x up
    np.testing.assert_allclose(R[:, 0], np.cross(-R[:, 2], [0, 0, 1]), atol=1e-12)


def test_sway_peak_speed_is_modest() -> None:
    """The moving whiteboard's platform peaks at 0.33 m/s at most."""
    path = load_scenario("whiteboard_moving").task.base.path
    assert path is not None and path.kind == "sway"
    (ax, ay), (wx, wy, _) = path.amplitude, path.frequency
    assert math.hypot(ax * wx, ay * wy) <= 0.33


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("duratoin = 3", ["duratoin", "did you mean 'duration'"]),
        ("duration = 0", ["duration", "greater than 0"]),
        ("[world]\nfriction_pen = -1", ["world.friction_pen", "greater than or equal to 0"]),
        ("[world.mismatch]\nlag = 2.0", ["world.mismatch.lag", "less than or equal to 0.9"]),
        ("[world.mismatch]\nlga = 0.1", ["world.mismatch.lga", "'lag'"]),
        ("[[disturbance]]\nkind = 'shove'\nt = 1", ["disturbance.0.kind", "push", "bias"]),
        ("[[disturbance]]\nkind = 'dropuot'\nt = 1", ["did you mean 'dropout'"]),
        (
            "[[disturbance]]\nkind = 'push'\nt = 1\nforce = 9\non = 'link9'",
            ["disturbance.0.push.on", "link6"],
        ),
        ("[[disturbance]]\nkind = 'push'\nt = 1\nforc = 9", ["forc:", "'force'"]),
        ("[task.base]\nbehaviour = 'dance'", ["task.base.behaviour", "'hold_still'"]),
        ("[task.base]\nbehaviour = 'drive_to'", ["task.base", "needs 'goal'"]),
        ("[task.base]\ngoal = [1, 2, 0]", ["task.base", "does not use 'goal'"]),
        ("[task.base]\nbehaviour='follow_path'\npath = {kind='spiral'}", ["path.kind", "sway"]),
        ("duration = nan", ["duration", "finite"]),
        ("duration = ", ["not TOML"]),
    ],
)
def test_error_names_file_key_and_what_is_allowed(
    tmp_path: Path, text: str, words: list[str]
) -> None:
    """A wrong entry is refused with its file, its key and what is allowed there."""
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(BadFile) as caught:
        load_scenario(file)
    for word in ["mine.toml", *words]:
        assert word in str(caught.value)


def test_unknown_name_lists_the_known() -> None:
    """An unknown scenario is refused with the nearest name and all known ones."""
    with pytest.raises(BadFile, match=r"did you mean 'whiteboard'.*whiteboard_push"):
        load_scenario("whitebord")


def test_program_is_found_beside_the_scenario_and_unknown_is_refused(tmp_path: Path) -> None:
    """Programs beside the scenario are found; one that is nowhere is refused by key."""
    file = tmp_path / "mine.toml"
    file.write_text("[task]\nprogram = 'own.hds'")
    with pytest.raises(BadFile, match=r"mine\.toml: task\.program: no program 'own\.hds'"):
        load_scenario(file).program_path()
    (tmp_path / "own.hds").write_text("")
    assert load_scenario(file).program_path() == tmp_path / "own.hds"
    assert Scenario().program_path() is None


def test_sensor_overrides_overlay_the_description() -> None:
    """Overrides replace exactly the keys they state."""
    robot = load_robot("xr4000_puma560")
    scenario = Scenario.model_validate({"sensors": {"odometry": {"rate": 5.0, "delay": 0.1}}})
    seen = scenario.sensors.overlay(robot)
    assert (seen.odometry.rate, seen.odometry.delay) == (5.0, 0.1)
    assert seen.odometry.resolution == robot.odometry.resolution
    assert seen.imu == robot.imu


def test_live_disturbance_takes_text() -> None:
    """Options typed as text become the same disturbance as in a file, beginning now."""
    made = disturbance_from("push", {"force": "200", "direction": "90", "on": "link3"}, now=4.0)
    assert made == Push(t=4.0, force=200.0, direction=90.0, on="link3")
    assert made.active(4.1) and not made.active(4.3) and not made.active(3.9)


def test_bias_stays_and_knows_its_axis() -> None:
    """A bias jump never ends, and a gyro's is about z by default."""
    bias = disturbance_from("bias", {"sensor": "gyro", "value": 0.01}, now=1.0)
    assert isinstance(bias, Bias)
    assert bias.axis_index == 2 and bias.active(1e6)


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        ("shove", {}, ["Known: push, bump"]),
        ("push", {}, ["'force' is missing", "0 to 5000"]),
        ("push", {"force": "much"}, ["force = 'much'"]),
        ("push", {"force": "nan"}, ["force", "finite"]),
        ("push", {"force": 1, "onn": "link1"}, ["no option 'onn' (did you mean 'on'", "link6"]),
        ("dropout", {"sensor": "sonar"}, ["'odometry', 'imu', 'laser'"]),
    ],
)
def test_live_disturbance_refusal_says_what_is_allowed(
    kind: str, options: dict[str, object], words: list[str]
) -> None:
    """A refused disturbance names the wrong option and lists the allowed ones."""
    with pytest.raises(ValueError) as caught:
        disturbance_from(kind, options, now=0.0)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    "options", [{}, {"force": 1, "on": "left_palm"}, {"force": 1, "on": "lin"}]
)
def test_a_refused_push_lists_what_this_robot_has(options: dict[str, object]) -> None:
    """No link of another robot is offered."""
    bodies = ("platform", "link1", "link2")
    with pytest.raises(ValueError) as caught:
        made = disturbance_from("push", options, 0.0, bodies)
        Timeline([], bodies).refuse(made)
    assert "platform, link1, link2" in str(caught.value)
    assert not re.search("link3|left_link|box", str(caught.value))


@pytest.mark.parametrize("kind", KINDS)
def test_every_option_is_described(kind: str) -> None:
    """No option of a disturbance is without an explanation."""
    assert all(describe(kind).values())
