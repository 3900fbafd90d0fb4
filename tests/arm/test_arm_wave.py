"""The long wave: one shape a seed, and a pen that waits for the platform."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from arm.board_place import BoardPlace
from arm.nodes import REGISTRY
from arm.nodes.whiteboard_wave import EASE, WhiteboardWave, varied, wave_points
from deploy.task import BoardPose
from services.arm_service import shaped
from services.messages import BoardEstimate
from sim.scenario import load_scenario

GIVEN = [0.05, 0.045, 0.65, 0.0]


def test_every_seed_draws_another_line_and_always_the_same() -> None:
    """Slanted to either side and wavy, within what the arm reaches up and down."""
    shapes = [varied(n, GIVEN) for n in range(1, 41)]
    assert shapes[0] == varied(1, GIVEN)
    assert len({tuple(s) for s in shapes}) == 40
    assert {np.sign(s[0]) for s in shapes} == {1.0, -1.0}
    for shape in shapes:
        points = wave_points(3.0, *shape)
        assert abs(points[-1, 1]) > 0.02  # never level: that would hide the platform's error
        assert np.abs(points[:, 1]).max() < 0.26


def test_a_run_sets_the_shape_of_its_seed() -> None:
    """Of the node that has one, and of no other."""
    from arm.hds import load

    path = load_scenario("long_line").program_path()
    assert path is not None
    program = load(path, REGISTRY)
    other = shaped(program, 7)
    assert other.nodes["Line"].parameters["Shape"] == 7
    assert {n for n in program.nodes if program.nodes[n] != other.nodes[n]} == {"Line"}


@pytest.mark.parametrize(("reach", "pace"), [(0.3, 1.0), (0.1 + EASE / 2, 0.5), (0.1, 0.0)])
def test_the_pen_slows_as_reach_shrinks(reach: float, pace: float) -> None:
    """Full pace with reach to spare, at rest at ``Margin``."""
    kind = REGISTRY["Whiteboard_wave"]
    values = {p.name: p.default for p in kind.parameters if p.default is not None}
    node = WhiteboardWave({**values, "Length": 3.0})
    context = SimpleNamespace(reach_margin=reach, pace=1.0, dt=0.001)
    with pytest.raises(AttributeError):  # of the stroke proper, which has its own tests
        node.update(context)  # type: ignore[arg-type]
    assert context.pace == pytest.approx(pace)


def test_the_board_moves_on_between_two_messages() -> None:
    """With its velocity, for a while; without messages it stays where it was believed."""
    board = BoardPose()
    place = BoardPlace(board)
    place.follow(1.0)
    assert (place.p == board.position()).all()
    seen = BoardEstimate(
        t=1.0,
        pose=np.array([0.68, -0.01, 0.0]),
        velocity=np.array([0.0, -0.001, 0.0]),
        covariance=np.eye(3),
    )
    place.see(seen)
    place.follow(1.05)
    assert place.p == pytest.approx([0.68, -0.01005, board.z])
    place.follow(9.0)
    assert place.p == pytest.approx([0.68, -0.0101, board.z])
    assert not place.velocity.any()
