"""A paused program goes on in another node: safely, without a bump, or not at all."""

from __future__ import annotations

import numpy as np
import pytest

from tests.arm.rig import AHEAD, EXACT, Rig, program, world_at

STROKES = """
INTERFACE = r1;
INITIAL = Approach;
ABORT = Away;
BEGIN
    NAME = Approach; TYPE = Whiteboard_approach;
    Force = 1 N; MaxX = 900 mm; Speed = 40 mm/s;
    TRANSITION[Contact] = Line; TRANSITION[Out_of_Reach] = End;
END
BEGIN
    NAME = Line; TYPE = Whiteboard_line;
    Length = 30; Direction = 225; Speed = 40; Force = 150;
    TRANSITION[Finished] = Second;
END
BEGIN
    NAME = Second; LIKE = Line;
    Direction = 315;
    TRANSITION[Finished] = Away;
END
BEGIN
    NAME = Away; TYPE = Goto_pose; Z = 20 mm;
    TRANSITION[Finished] = End;
END
"""


def paused(after: float = 1.0) -> Rig:
    """A rig paused in the middle of the first line, the pen off the board."""
    rig = Rig(world_at(AHEAD + 0.006, mismatch=EXACT)).run(0.02)
    rig.arm.start(program(STROKES))
    rig.until_drawn(0.01)
    rig.arm.pause()
    return rig.run(after)


def bump(rig: Rig, since: int) -> float:
    """The greatest change of a joint's reference rate in one tick [rad/s]."""
    return float(np.abs(np.diff(np.array(rig.rate[since:]), axis=0)).max())


def test_a_jump_moves_nothing_before_it_is_resumed() -> None:
    """The status says where it will go on."""
    rig = paused()
    tip = rig.tip[-1]
    rig.arm.jump("Away")
    rig.run(0.2)
    assert rig.status.state == "paused"
    assert rig.status.node == "Away"
    assert "goes on in Away" in rig.status.reason
    assert np.linalg.norm(rig.tip[-1] - tip) < 1e-3


def resumed(rig: Rig) -> Rig:
    """Until a third of a second after the program runs again."""
    rig.arm.resume()
    return rig.until_state("running").run(0.3)


@pytest.fixture(scope="module")
def usual() -> float:
    """What a plain resume does to the joints [rad/s]."""
    rig = paused()
    since = rig.ticks
    return bump(resumed(rig), since)


@pytest.mark.parametrize("node", ["Away", "Approach", "Second"])
def test_a_jump_enters_the_node_without_a_bump(node: str, usual: float) -> None:
    """A free node from where the tip is; one that presses after the pen is back on the board."""
    rig = paused()
    rig.arm.jump(node)
    since, seen = rig.ticks, len(rig.statuses)
    resumed(rig)
    assert {s.node for s in rig.statuses[seen:]} == {node}
    assert bump(rig, since) <= 1.05 * usual
    assert (rig.force[-1] > 0.5) == (node == "Second")


def test_a_node_that_presses_is_not_entered_in_the_air() -> None:
    """Paused in the approach, the line cannot be drawn; the reason says what to do."""
    rig = Rig(world_at(AHEAD + 0.03, mismatch=EXACT)).run(0.02)
    rig.arm.start(program(STROKES))
    rig.run(0.1)
    rig.arm.pause()
    rig.run(0.1)
    with pytest.raises(ValueError, match="Line presses on the board, and the pen is not on it"):
        rig.arm.jump("Line")
    with pytest.raises(ValueError, match="presses on the board"):
        rig.arm.follow("Contact")
    assert rig.status.node == "Approach"
    resumed(rig)
    assert rig.status.node == "Approach"


def test_follow_goes_where_the_event_leads() -> None:
    """Abort to the abort node, Finished to the next line."""
    rig = paused()
    rig.arm.follow("Finished")
    rig.run(0.03)
    assert (rig.status.node, rig.status.event) == ("Second", "Finished")
    rig.arm.follow("Abort")
    rig.run(0.03)
    assert (rig.status.node, rig.status.event) == ("Away", "Abort")
    rig.arm.follow("Finished")
    rig.arm.resume()
    rig.until_state("finished", 1.0)


def test_an_interrupted_return_still_goes_where_it_was_told() -> None:
    """Paused again on the way back to the board, the jump is not forgotten."""
    rig = paused()
    rig.arm.jump("Second")
    rig.arm.resume()
    rig.run(0.1)
    assert rig.arm.state == "resuming"
    rig.arm.pause()
    rig.run(0.3)
    seen = len(rig.statuses)
    resumed(rig)
    assert {s.node for s in rig.statuses[seen:]} == {"Second"}


@pytest.mark.parametrize("what", ["jump", "follow"])
def test_only_an_interrupted_program_can_be_redirected(what: str) -> None:
    """Not without a program, not while it runs, and not to what is not there."""
    rig = Rig(world_at(AHEAD + 0.006, mismatch=EXACT)).run(0.02)
    ask = rig.arm.jump if what == "jump" else rig.arm.follow
    with pytest.raises(ValueError, match="the arm is idle"):
        ask("Away")
    rig.arm.start(program(STROKES))
    rig.run(0.01)
    with pytest.raises(ValueError, match="the arm is running; pause its program first"):
        ask("Away")
    rig.arm.pause()
    rig.run(0.01)
    with pytest.raises(ValueError, match=r"there are: Approach, Line, Second, Away|it handles"):
        ask("Nowhere")
