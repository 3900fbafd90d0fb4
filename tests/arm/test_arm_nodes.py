"""Every node type, run by a program on the simulated robot; and what pen and load cell feel."""

from __future__ import annotations

import numpy as np
import pytest

from deploy.task import PROGRAMS
from services.messages import ArmState, Array
from services.reports.evaluation import distance_to_path
from tests.arm.rig import AHEAD, EXACT, Rig, from_file, program, world_at

NEAR = AHEAD + 0.006


def node(name: str, kind: str, body: str) -> str:
    """A node's text."""
    return f"BEGIN NAME = {name}; TYPE = {kind}; {body} END\n"


def run(*nodes: str, board: float = NEAR, limit: float = 10.0) -> Rig:
    """Run a program of these nodes, from the first one, to its end."""
    initial = nodes[0].split("NAME = ")[1].split(";")[0]
    rig = Rig(world_at(board, mismatch=EXACT)).run(0.05)
    rig.arm.start(program(f"INTERFACE = r1; INITIAL = {initial};\n" + "".join(nodes)))
    return rig.until_state("finished", limit)


def stroke_of(rig: Rig) -> tuple[Array, Array]:
    """Tip in the board's plane and force, where a stroke was drawn."""
    spans = [s.t for s in rig.statuses if s.stroke]
    t = np.array(rig.t)
    inside = (t >= spans[0]) & (t <= spans[-1])
    return np.array(rig.tip)[inside, :2], np.array(rig.force)[inside]


def test_paper_fragment_draws_its_line_as_printed() -> None:
    """50 mm at 225 deg: down and to the left, straight, under 1.5 N, then 50 mm off the board."""
    rig = Rig(world_at(AHEAD + 0.02, mismatch=EXACT)).run(0.05)
    start = rig.tip[-1][:2]
    rig.arm.start(from_file(PROGRAMS / "paper_fragment.hds"))
    rig.until_state("finished")
    drawn, force = stroke_of(rig)
    way = 0.05 * np.array([np.cos(np.radians(225)), np.sin(np.radians(225))])
    line = start + np.linspace(0, 1, 200)[:, None] * way
    assert np.sqrt(np.mean(distance_to_path(drawn, line) ** 2)) < 1e-4
    np.testing.assert_allclose(drawn[-1], start + way, atol=3e-4)
    mean = np.convolve(force, np.ones(20) / 20, mode="valid")
    assert np.abs(mean - 1.5).max() < 0.5
    assert np.sqrt(np.mean((mean - 1.5) ** 2)) < 0.2
    assert rig.tip[-1][2] == pytest.approx(0.05, abs=1e-3)


def test_approach_says_out_of_reach_when_the_board_is_too_far() -> None:
    """Without a board before MaxX the approach gives up there, and never feels a contact."""
    rig = run(
        node(
            "A",
            "Whiteboard_approach",
            "Force = 200; MaxX = 620; Speed = 50; "
            "TRANSITION[Contact] = C; TRANSITION[Out_of_Reach] = End;",
        ),
        node("C", "Hold", "Time = 5; TRANSITION[Timeout] = End;"),
        board=0.75,
    )
    assert rig.status.event == "Out_of_Reach"
    assert 0.75 - rig.tip[-1][2] == pytest.approx(0.62, abs=0.003)


def test_approach_stops_at_the_contact() -> None:
    """The event comes with the threshold; the impact stays small."""
    rig = run(
        node(
            "A",
            "Whiteboard_approach",
            "Force = 100; Speed = 20; TRANSITION[Contact] = End; TRANSITION[Out_of_Reach] = H;",
        ),
        node("H", "Hold", "Time = 5; TRANSITION[Timeout] = End;"),
    )
    assert rig.status.event == "Contact"
    assert 0.5 < max(rig.force) < 3.0


def test_hold_ends_after_its_time_and_keeps_the_tip() -> None:
    """Timeout comes after Time, to the tick; the tip has not moved."""
    rig = run(node("H", "Hold", "Time = 300 ms; TRANSITION[Timeout] = End;"))
    began = next(s.t for s in rig.statuses if s.state == "running")
    ended = next(s.t for s in rig.statuses if s.state == "finished")
    assert ended - began == pytest.approx(0.3, abs=0.0021)
    assert np.ptp(np.array(rig.tip)[50:], axis=0).max() < 2e-4


def test_goto_reaches_its_point_and_keeps_what_is_not_given() -> None:
    """X and Z are reached within 1 mm; Y stays."""
    rig = run(
        node("G", "Goto_pose", "X = 40; Z = 30; Speed = 150; TRANSITION[Finished] = End;"),
        board=0.62,
    )
    start = rig.tip[40]
    np.testing.assert_allclose(rig.tip[-1], [0.04, start[1], 0.03], atol=1e-3)


def test_goto_timeout_comes_first_when_the_way_is_long() -> None:
    """A node with a Timeout that is too short raises it."""
    rig = run(
        node(
            "G",
            "Goto_pose",
            "X = 100; Speed = 20; Timeout = 200 ms; "
            "TRANSITION[Finished] = H; TRANSITION[Timeout] = End;",
        ),
        node("H", "Hold", "Time = 5; TRANSITION[Timeout] = End;"),
    )
    assert rig.status.event == "Timeout"


def test_circle_is_closed_and_round() -> None:
    """The pen comes back to where it began; every point is a radius from the centre."""
    rig = run(
        node(
            "A",
            "Whiteboard_approach",
            "Force = 100; Speed = 40; TRANSITION[Contact] = O; TRANSITION[Out_of_Reach] = End;",
        ),
        node(
            "O",
            "Whiteboard_circle",
            "Radius = 10; Start = 90; Speed = 40; TRANSITION[Finished] = End;",
        ),
    )
    drawn, _ = stroke_of(rig)
    assert np.linalg.norm(drawn[-1] - drawn[0]) < 3e-4
    centre = drawn[0] + np.array([0.0, -0.01])
    radius = np.linalg.norm(drawn - centre, axis=1)
    assert np.abs(radius - 0.01).max() < 3e-4
    # counter-clockwise: from the top first to the left
    assert drawn[:, 0].argmin() < drawn[:, 0].argmax()


def test_pen_and_load_cell_agree_with_the_spring() -> None:
    """Pressed on the board at rest, the load cell reads the contact force, which the spring gives.

    DART integrates the spring implicitly and contact impulses not, which makes the contact
    weaker by m / (m + c dt + k dt^2): 5 % for this pen.
    """
    rig = Rig(world_at(NEAR, mismatch=EXACT)).run(0.05)
    rig.arm.start(
        program(
            "INTERFACE = r1; INITIAL = A;\n"
            + node(
                "A",
                "Whiteboard_approach",
                "Force = 150; Speed = 20; TRANSITION[Contact] = H; TRANSITION[Out_of_Reach] = End;",
            )
            + node("H", "Hold", "Time = 1; TRANSITION[Timeout] = End;")
        )
    )
    rig.until(lambda: rig.status.node == "H").run(0.3)
    read = []
    for _ in range(100):
        states = [m for m in rig.step() if isinstance(m, ArmState)]
        read.append(-states[0].wrench[2])
    skeleton = rig.sim.physics._skeleton
    pen = rig.sim.physics.robot.pen
    mass = skeleton.getBodyNode("pen").getMass()
    share = mass / (mass + pen.damping * 0.001 + pen.stiffness * 1e-6)
    spring = -pen.stiffness * skeleton.getPositions()[9]
    force = float(np.mean(rig.force[-100:]))
    assert force > 1.0
    assert force == pytest.approx(share * spring, rel=0.01)
    assert np.mean(read) == pytest.approx(force, abs=0.05)
