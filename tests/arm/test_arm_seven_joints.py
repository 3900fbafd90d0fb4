"""An arm with a joint to spare: the same programs, and a posture in what freedom they leave."""

from __future__ import annotations

import numpy as np
import pytest

from arm.control import Orientation, Position, Posture
from arm.control.priority import priorities
from arm.executive import POSTURE
from arm.model import STANDING, ArmModel, Array
from arm.nodes.node import TOOL_ON_BOARD
from deploy.robot import BadFile, load_robot
from sim.scenario import load_scenario

ROBOT = "rmp_seven_joints"
SCENARIO = "whiteboard_seven_joints"


@pytest.fixture(scope="module")
def model() -> ArmModel:
    """The described arm."""
    return ArmModel(ROBOT)


def follow(model: ArmModel, q: Array, posture: Posture | None, seconds: float) -> Array:
    """Joints after keeping the tool where the rest posture has it, ticks of 5 ms, (7,) [rad]."""
    rest = np.array(model.robot.arm.rest)
    at = model.place(STANDING, rest, np.zeros(7))
    position, orientation = Position(np.eye(3)), Orientation(at.R.copy())
    position.track(at.p.copy(), np.zeros(3))
    parts = [*orientation.subject_to(position).parts(), *([posture] if posture else [])]
    for _ in range(round(seconds / 0.005)):
        k = model.place(STANDING, q, np.zeros(7))
        q = q + 0.005 * priorities([p.rows(k, 0.005) for p in parts], 7).qd
    return q


def test_it_starts_pen_level_square_to_its_board(model: ArmModel) -> None:
    """Rest is before the scenario's board, far from joint limits and from the end of its reach."""
    rest = np.array(model.robot.arm.rest)
    at = model.place(STANDING, rest, np.zeros(7))
    board = load_scenario(SCENARIO).task.board
    np.testing.assert_allclose(at.R, board.rotation() @ TOOL_ON_BOARD, atol=1e-3)
    in_board = board.rotation().T @ (at.p - board.position())
    assert 0.02 < in_board[2] < 0.10 and np.abs(in_board[:2]).max() < 0.01
    assert model.joint_margin(rest) > 0.3
    assert model.robot.arm.reach - model.stretch() > 0.1


def test_the_spare_joint_goes_to_rest_and_the_tool_stays(model: ArmModel) -> None:
    """From an elbow swung aside by the spare joint alone; without a posture it stays aside."""
    rest = np.array(model.robot.arm.rest)
    k = model.place(STANDING, rest, np.zeros(7))
    along = np.linalg.svd(k.J)[2][6]  # what moves no tool
    aside = follow(model, rest + 0.5 * along, None, 2.0)
    tool = model.place(STANDING, aside, np.zeros(7)).p.copy()
    assert np.linalg.norm(aside - rest) > 0.3
    back = follow(model, aside, Posture(rest, gain=POSTURE), 8.0)
    assert np.linalg.norm(back - rest) < 0.01
    assert np.linalg.norm(model.place(STANDING, back, np.zeros(7)).p - tool) < 1e-4
    assert np.linalg.norm(follow(model, aside, None, 8.0) - rest) > 0.3


def test_the_posture_takes_nothing_from_the_tool(model: ArmModel) -> None:
    """Rates along the tool's rows are those asked for, whatever the posture wants."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        q = np.array(model.robot.arm.rest) + rng.uniform(-0.2, 0.2, 7)
        k = model.place(STANDING, q, np.zeros(7))
        position, orientation = Position(np.eye(3)), Orientation(k.R.copy())
        velocity = rng.uniform(-0.3, 0.3, 3)
        position.track(k.p.copy(), velocity)
        posture = Posture(q + rng.uniform(-1.0, 1.0, 7), gain=POSTURE)
        parts = (*orientation.subject_to(position).parts(), posture)
        qd = priorities([p.rows(k, 0.001) for p in parts], 7).qd
        np.testing.assert_allclose(k.J @ qd, [*velocity, 0, 0, 0], atol=1e-6)
        # and all that is left goes to the posture
        spare = np.linalg.svd(k.J)[2][6]
        wanted = POSTURE * spare @ (posture.target - q)
        assert spare @ qd == pytest.approx(wanted, rel=0.01)


def test_a_value_too_few_is_refused(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of seven joints each has a limit, or the description is refused with the count."""
    import deploy.robot as robots

    text = (robots.ROBOTS / ROBOT / "robot.toml").read_text()
    (tmp_path / "short").mkdir()
    (tmp_path / "short" / "robot.toml").write_text(text.replace(", 3.1, 3.1]", ", 3.1]", 1))
    monkeypatch.setattr(robots, "ROBOTS", tmp_path)
    with pytest.raises(BadFile, match="velocity_limit has 6 values for 7 joints"):
        load_robot("short")
