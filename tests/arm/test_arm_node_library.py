"""Node types beyond the whiteboard's first ones, run by programs on the simulated robot."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from arm.nodes.frames import pointing
from services.messages import Array, BaseCommand
from services.reports.evaluation import distance_to_path
from tests.arm.rig import EXACT, Rig, program, world_at
from tests.arm.test_arm_nodes import NEAR, node, run

TOUCH = node(
    "A",
    "Guarded_move",
    "DZ = -1; Force = 80; Speed = 40; Distance = 30; TRANSITION[Contact] = B; "
    "TRANSITION[No_Contact] = End; TRANSITION[Out_of_Reach] = End;",
)
DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 30 20">
<path d="M 0 10 C 0 0 15 0 15 10 L 15 18 L 22 18"/><path d="M 24 4 L 30 4"/></svg>"""


def parts(rig: Rig) -> list[Array]:
    """Tip in the board's plane along every stroke."""
    t, tip = np.array(rig.t), np.array(rig.tip)
    out = []
    for number in sorted({s.stroke for s in rig.statuses} - {0}):
        spans = [s.t for s in rig.statuses if s.stroke == number]
        out.append(tip[(t >= spans[0]) & (t <= spans[-1]), :2])
    return out


def test_an_svg_file_is_drawn_stroke_by_stroke(tmp_path: Path) -> None:
    """Curve, corner and second stroke are within 0.3 mm of the file's; pen up between; then off."""
    file = tmp_path / "two.svg"
    file.write_text(DRAWING)
    rig = run(
        node(
            "P",
            "Whiteboard_path",
            f'File = "{file}"; Width = 30; Speed = 60; Acceleration = 0.4; Travel = 200; '
            "TRANSITION[Finished] = End; TRANSITION[Out_of_Reach] = End;",
        ),
        limit=12.0,
    )
    assert rig.status.event == "Finished"
    first, second = parts(rig)
    # in mm of the board: the file's middle is at (15, 11) and its y points down
    u = np.linspace(0.0, 1.0, 100)[:, None]
    corners = [np.array(p, float) for p in ((0, 10), (0, 0), (15, 0), (15, 10))]
    weights = ((1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3)
    bezier = sum(w * p for w, p in zip(weights, corners, strict=True))
    path = np.concatenate([bezier, [[15.0, 18.0], [22.0, 18.0]]])
    top, bottom = 2.5, 18.0  # of the file
    middle = np.array([15.0, 0.5 * (top + bottom)])
    path = (path - middle) * np.array([1e-3, -1e-3])
    dense = np.concatenate([np.linspace(a, b, 60) for a, b in pairwise(path)])
    error = distance_to_path(first, dense)
    assert np.sqrt(np.mean(error**2)) < 1e-4
    assert error.max() < 3e-4
    assert np.linalg.norm(first[-1] - path[-1]) < 3e-4
    assert np.ptp(second[:, 1]) < 3e-4
    assert np.ptp(second[:, 0]) == pytest.approx(0.006, abs=3e-4)
    lifted = [s for s in rig.statuses if s.node == "P" and not s.stroke]
    assert max(s.reference[2] for s in lifted) > 0.008
    assert rig.tip[-1][2] > 0.008


def test_a_path_without_a_board_gives_up_and_says_so(tmp_path: Path) -> None:
    """The board is believed 30 mm nearer than it is, and more: the pen stops looking."""
    file = tmp_path / "two.svg"
    file.write_text(DRAWING)
    text = "INTERFACE = r1; INITIAL = P;\n" + node(
        "P",
        "Whiteboard_path",
        f'File = "{file}"; Width = 30; TRANSITION[Finished] = H; TRANSITION[Out_of_Reach] = End;',
    )
    text += node("H", "Hold", "Time = 1; TRANSITION[Timeout] = End;")
    rig = Rig(world_at(NEAR + 0.08, believed=NEAR, mismatch=EXACT)).run(0.05)
    rig.arm.start(program(text))
    rig.until_state("finished")
    assert rig.status.event == "Out_of_Reach"
    assert "no board felt for curve 1 of 2" in rig.status.reason
    assert max(rig.force) == 0.0


def test_touch_press_wipe_and_retract() -> None:
    """A guarded move ends at the contact; a press holds 3 N for its time; a wipe covers its
    rectangle under 2 N; a retract takes the tip off by its distance."""
    rig = run(
        TOUCH,
        node("B", "Whiteboard_press", "Force = 300; Time = 400 ms; TRANSITION[Finished] = C;"),
        node(
            "C",
            "Whiteboard_wipe",
            "Width = 20; Height = 8; Spacing = 4; Force = 200; Speed = 80; Acceleration = 0.4; "
            "TRANSITION[Finished] = D;",
        ),
        node("D", "Retract", "Distance = 25; TRANSITION[Finished] = End;"),
        limit=12.0,
    )
    assert rig.status.event == "Finished"
    t, force = np.array(rig.t), np.array(rig.force)
    began = {s.node: s.t for s in reversed(rig.statuses)}
    held = (t > began["C"] - 0.3) & (t < began["C"])
    assert force[held].mean() == pytest.approx(3.0, abs=0.1)
    assert began["C"] - began["B"] > 0.4
    (wiped,) = parts(rig)
    np.testing.assert_allclose(np.ptp(wiped, axis=0), [0.02, 0.008], atol=5e-4)
    wiping = (t > began["C"] + 0.8) & (t < began["D"])
    assert force[wiping].mean() == pytest.approx(2.0, abs=0.1)
    surface = rig.desired[round(began["D"] / 0.001) - 1][2]
    assert rig.desired[-1][2] - surface == pytest.approx(0.025, abs=1e-3)


def test_a_guarded_move_gives_up_after_its_distance() -> None:
    """Sideways there is nothing: No_Contact after 20 mm, and not before."""
    rig = run(
        node(
            "A",
            "Guarded_move",
            "DX = 1; DY = 1; Force = 100; Speed = 60; Distance = 20; TRANSITION[Contact] = H; "
            "TRANSITION[No_Contact] = End; TRANSITION[Out_of_Reach] = H;",
        ),
        node("H", "Hold", "Time = 5; TRANSITION[Timeout] = End;"),
    )
    assert rig.status.event == "No_Contact"
    way = rig.tip[-1] - rig.tip[40]
    np.testing.assert_allclose(way[:2], 0.02 / np.sqrt(2), atol=1.5e-3)


def test_a_direction_without_length_is_refused_at_the_start() -> None:
    """Before anything moves, with the node's name."""
    rig = Rig(world_at(NEAR, mismatch=EXACT)).run(0.05)
    text = "INTERFACE = r1; INITIAL = A;\n" + TOUCH.replace("DZ = -1; ", "").replace("= B", "= End")
    with pytest.raises(ValueError, match=r"node A: .* no direction"):
        rig.arm.start(program(text))
    assert rig.arm.state == "idle"


@pytest.mark.parametrize("kind", ["Goto_ground", "Goto_platform"])
def test_a_way_ends_in_its_own_frame_while_the_platform_drives(kind: str) -> None:
    """On a platform that drives and turns, the tip ends within 2 mm of a point that stands still
    in the frame, and the pen within 1 deg of the direction asked for in it."""
    rig = Rig(world_at(1.5, mismatch=EXACT)).run(0.05)
    rig.base = BaseCommand(t=0.0, velocity=np.array([0.02, 0.04, 0.08]))
    x, y, z = 0.62, 0.04, 1.35
    text = "INTERFACE = r1; INITIAL = G;\n" + node(
        "G",
        kind,
        f"X = {x} m; Y = {y} m; Z = {z} m; Heading = 10 deg; Elevation = -5 deg; "
        "Speed = 150; TRANSITION[Finished] = End;",
    )
    rig.arm.start(program(text))
    for _ in range(6000):
        rig.base = BaseCommand(t=rig.now, velocity=np.array([0.02, 0.04, 0.08]))
        rig.step()
        if rig.arm.state == "finished":
            break
    assert rig.status.event == "Finished"
    base = rig.sim.physics.pose
    at = rig.arm.model.place(rig.arm._platform.base, rig.arm._reference.q, np.zeros(6))
    c, s = np.cos(base[2]), np.sin(base[2])
    R_OB = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    R, origin = (np.eye(3), np.zeros(3)) if kind == "Goto_ground" else (R_OB, [*base[:2], 0.0])
    np.testing.assert_allclose(R.T @ (at.p - origin), [x, y, z], atol=2e-3)
    wanted = R @ pointing(np.radians(10), np.radians(-5))[:, 2]
    assert np.degrees(np.arccos(wanted @ at.R[:, 2])) < 1.0
    assert np.linalg.norm(base[:2]) > 0.01


def test_wait_ends_with_its_event_and_refuses_others() -> None:
    """An event is refused before the node waits, and one of another name; its own ends it."""
    rig = Rig(world_at(NEAR, mismatch=EXACT)).run(0.05)
    with pytest.raises(ValueError, match="no node waits"):
        rig.arm.signal("go")
    text = "INTERFACE = r1; INITIAL = W;\n" + node(
        "W", "Wait", "Event = go; Time = 5; TRANSITION[Received] = End; TRANSITION[Timeout] = H;"
    )
    text += node("H", "Hold", "Time = 1; TRANSITION[Timeout] = End;")
    rig.arm.start(program(text))
    rig.run(0.2)
    with pytest.raises(ValueError, match="waits for 'go', not for 'stop'"):
        rig.arm.signal("stop")
    assert rig.status.node == "W"
    rig.arm.signal("go")
    rig.run(0.005)
    assert rig.arm.state == "finished"
    assert rig.status.event == "Received"


def test_a_platform_that_does_not_come_is_blocked() -> None:
    """The goal goes out with the status; nobody drives; after 3 s the program goes on elsewhere
    with the reason, and the goal is taken back."""
    rig = Rig(world_at(NEAR, mismatch=EXACT)).run(0.05)
    text = "INTERFACE = r1; INITIAL = D;\n" + node(
        "D",
        "Drive_to",
        "X = -0.5; Y = 0.1; Heading = 20; TRANSITION[Arrived] = H; TRANSITION[Blocked] = End;",
    )
    text += node("H", "Hold", "Time = 1; TRANSITION[Timeout] = End;")
    rig.arm.start(program(text))
    rig.run(0.1)
    assert rig.status.goal_number == 1
    np.testing.assert_allclose(rig.status.goal, [-0.5, 0.1, np.radians(20)])
    rig.until_state("finished", 4.0).run(0.03)
    assert rig.status.event == "Blocked"
    assert "came no nearer than 0.51 m" in rig.status.reason
    assert rig.status.goal_number == 0


def test_an_interrupted_path_is_finished_where_it_was_left(tmp_path: Path) -> None:
    """Paused in the first curve, the pen is lifted, comes back, and draws the rest: together the
    pieces cover the whole line."""
    file = tmp_path / "one.svg"
    file.write_text(DRAWING)
    text = "INTERFACE = r1; INITIAL = P;\n" + node(
        "P",
        "Whiteboard_path",
        f'File = "{file}"; Width = 30; Speed = 60; Acceleration = 0.4; Travel = 200; '
        "TRANSITION[Finished] = End; TRANSITION[Out_of_Reach] = End;",
    )
    rig = Rig(world_at(NEAR, mismatch=EXACT)).run(0.05)
    rig.arm.start(program(text))
    rig.until(lambda: rig.arm._step.measures.get("Drawn", 0.0) > 0.01)
    rig.arm.pause()
    rig.run(0.6)
    assert rig.force[-1] == 0.0
    rig.arm.resume()
    rig.until_state("finished", 12.0)
    first, second = parts(rig)
    u = np.linspace(0.0, 1.0, 200)[:, None]
    corner = np.array([[0, 10], [0, 0], [15, 0], [15, 10]], float)
    weights = ((1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3)
    line = np.concatenate(
        [sum(w * p for w, p in zip(weights, corner, strict=True)), [[15.0, 18.0], [22.0, 18.0]]]
    )
    line = (line - np.array([15.0, 10.25])) * np.array([1e-3, -1e-3])
    assert distance_to_path(line, first).max() < 5e-4
    assert np.ptp(second[:, 0]) == pytest.approx(0.006, abs=3e-4)
