"""Whether a drawing is within reach is said before anything moves."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from arm.hds import load
from arm.nodes import REGISTRY, build
from arm.nodes.build import unusable
from arm.nodes.whiteboard_path import WhiteboardPath
from arm.reachable import Reachability
from deploy.task import PROGRAMS, BoardPose
from tests.arm.rig import from_file, program

ROBOT = "xr4000_puma560"
HOME = np.zeros(3)


@pytest.fixture(scope="module")
def reach() -> Reachability:
    """Of the robot before its board."""
    return Reachability(ROBOT, BoardPose())


def drawing(body: str, more: str = "") -> str:
    """A program that draws the portrait."""
    return (
        "INTERFACE = r1; INITIAL = P;\n"
        f'BEGIN NAME = P; TYPE = Whiteboard_path; File = "portrait.svg"; {body} '
        "TRANSITION[Finished] = End; TRANSITION[Out_of_Reach] = End; END\n" + more
    )


def test_the_portrait_is_within_reach_over_the_whole_sway(reach: Reachability) -> None:
    """From the middle and from the corners of the sway every point is reached."""
    portrait = from_file(PROGRAMS / "portrait.hds")
    reach.refuse(portrait, HOME)
    points = program(drawing("Width = 260; Y = 100;"))
    for corner in ((-0.1, -0.3, 0.087), (-0.1, 0.3, -0.087), (0.1, 0.3, 0.087)):
        reach.refuse(points, np.array(corner))


def test_too_wide_a_drawing_is_refused_by_its_worst_point(reach: Reachability) -> None:
    """The error names the node, how many points are too far, and which is farthest."""
    with pytest.raises(ValueError, match=r"node P: .* points are out of reach") as refused:
        reach.refuse(program(drawing("Width = 700; Y = -100;")), HOME)
    x, y = (float(v) for v in re.findall(r"[xy] = (-?\d+) mm", str(refused.value)))
    made = program(drawing("Width = 700; Y = -100;"))
    control = build(made.nodes["P"], made)
    assert isinstance(control, WhiteboardPath)
    # the shoulder is high and right in front: the farthest point is the one farthest from it
    far = np.hypot(control.points()[:, 0], control.points()[:, 1] - 0.22)
    assert far.max() - np.hypot(x / 1e3, y / 1e3 - 0.22) < 0.03
    assert "mm are missing" in str(refused.value)


def test_a_margin_is_kept(reach: Reachability) -> None:
    """What is reached with 150 mm to spare is refused if 300 mm are to be left."""
    reach.refuse(program(drawing("Width = 260; Y = 100; Margin = 150;")), HOME)
    with pytest.raises(ValueError, match="300 mm must be left"):
        reach.refuse(program(drawing("Width = 260; Y = 100; Margin = 300;")), HOME)


def test_a_goal_for_the_platform_counts(reach: Reachability) -> None:
    """From 1 m behind nothing is reached, unless the program first drives there."""
    behind = np.array([-1.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="out of reach"):
        reach.refuse(program(drawing("Width = 260; Y = 100;")), behind)
    drive = (
        "BEGIN NAME = D; TYPE = Drive_to; X = 0; Y = 0; "
        "TRANSITION[Arrived] = P; TRANSITION[Blocked] = End; END\n"
    )
    text = drawing("Width = 260; Y = 100;", drive).replace("INITIAL = P", "INITIAL = D")
    reach.refuse(program(text), behind)


def test_joint_limits_count_where_reach_does_not() -> None:
    """On a board beside the robot the arm is long enough and joint 1 cannot turn that far."""
    board = BoardPose(x=-0.68, y=0.0, yaw=np.pi)
    with pytest.raises(ValueError, match="joint"):
        Reachability(ROBOT, board).refuse(program(drawing("Width = 200; Y = 100;")), HOME)


def test_a_file_that_is_not_there_is_named_with_the_node(
    reach: Reachability, tmp_path: Path
) -> None:
    """The places looked in are named too."""
    text = drawing("Width = 260;").replace("portrait.svg", "nobody.svg")
    with pytest.raises(ValueError, match=r"node P: there is no file 'nobody.svg' in .*programs"):
        reach.refuse(program(text), HOME)


def test_the_checker_names_a_node_that_cannot_be_made() -> None:
    """`program check` gives one finding, an error at the node's line; a good program gives none."""
    assert unusable(REGISTRY, program(drawing("Width = 260;"))) == []
    text = drawing("Width = 260;").replace("portrait.svg", "nobody.svg")
    (found,) = unusable(REGISTRY, program(text))
    assert (found.severity, found.code, found.line) == ("error", "unusable", 2)
    assert "nobody.svg" in found.message


SVG = '<svg xmlns="http://www.w3.org/2000/svg"><path d="M 0 0 L 10 5"/></svg>'


@pytest.mark.parametrize(
    ("main", "part", "beside"),
    [
        ("INITIAL = P; {include}", '{draw} File = "a.svg"; END', "parts"),
        ('INITIAL = P; {include} CONSTANT Picture = "a.svg";', "{draw} File = Picture; END", "."),
        ('INITIAL = Q; {include} {like} File = "a.svg"; END', '{draw} File = "b.svg"; END', "."),
        ("INITIAL = Q; {include} {like} END", '{draw} File = "a.svg"; END', "parts"),
    ],
    ids=["written there", "by a constant", "set again", "taken over"],
)
def test_a_file_is_looked_for_beside_where_its_name_is_written(
    main: str, part: str, beside: str, tmp_path: Path
) -> None:
    """In the folder of the included file or in the program's, and in no other."""
    (tmp_path / "parts").mkdir()
    pieces = {
        "include": 'INCLUDE "parts/part.hds";',
        "draw": "BEGIN NAME = P; TYPE = Whiteboard_path; Width = 30; "
        "TRANSITION[Finished] = End; TRANSITION[Out_of_Reach] = End;",
        "like": "BEGIN NAME = Q; LIKE = P;",
    }
    (tmp_path / "main.hds").write_text("INTERFACE = r1; " + main.format(**pieces))
    (tmp_path / "parts" / "part.hds").write_text("\n" + part.format(**pieces))
    (tmp_path / "parts" / "b.svg").write_text(SVG)
    made = load(tmp_path / "main.hds", REGISTRY)
    there = tmp_path / beside
    found = unusable(REGISTRY, made)[-1]
    assert f"no file 'a.svg' in {there.resolve()}" in found.message
    assert found.source[found.column - 1 :][: found.length] == '"a.svg"'
    assert Path(found.file).parent.resolve() == there.resolve()
    (there / "a.svg").write_text(SVG)
    assert unusable(REGISTRY, made) == []
