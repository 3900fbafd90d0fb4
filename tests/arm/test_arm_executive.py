"""The executive: inputs that fail, requests, limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from arm.hds import Program
from arm.limits import Limits
from arm.model import ArmModel
from services.messages import Estimate
from sim.scenario import Scenario
from tests.arm.rig import AHEAD, EXACT, Rig, program, world_at

STROKE = """
INTERFACE = r1;
INITIAL = Approach;
BEGIN
    NAME = Approach; TYPE = Whiteboard_approach;
    Force = 1 N; MaxX = 900 mm; Speed = 40 mm/s;
    TRANSITION[Contact] = Line; TRANSITION[Out_of_Reach] = End;
END
BEGIN
    NAME = Line; TYPE = Whiteboard_line;
    Length = 30; Direction = 225; Speed = 40; Force = 150;
    TRANSITION[Finished] = Away;
END
BEGIN
    NAME = Away; TYPE = Goto_pose; Z = 20 mm;
    TRANSITION[Finished] = End;
END
"""
NEAR = AHEAD + 0.006  # of a board right in front of the pen [m]


def drawing(length: float = 0.01, scenario: Scenario | None = None) -> Rig:
    """A rig in the middle of a stroke."""
    rig = Rig(scenario or world_at(NEAR, mismatch=EXACT)).run(0.02)
    rig.arm.start(program(STROKE))
    return rig.until_drawn(length)


def at_rest(scenario: Scenario | None = None) -> Rig:
    """A rig whose arm holds still in front of the board."""
    return Rig(scenario or world_at(NEAR, mismatch=EXACT)).run(0.02)


def silent(_: Estimate) -> None:
    """No estimate arrives any more."""
    return None


def frozen(rig: Rig) -> Estimate:
    """The newest estimate, for ever."""
    assert rig._estimate is not None
    return rig._estimate


def invalid(estimate: Estimate) -> Estimate:
    """The observer does not trust itself."""
    return replace(estimate, valid=False, reason="covariance too large")


# --- inputs that fail -----------------------------------------------------------------------


@pytest.mark.parametrize("how", ["silent", "old", "invalid"])
def test_lost_estimate_leads_to_a_safe_hold(how: str) -> None:
    """Mid-stroke: contact is gone within 0.3 s, the status names cause and node, and later the
    line is finished where it was left."""
    rig = drawing()
    before = rig.ticks
    last = frozen(rig)
    rig.sense = {"silent": silent, "old": lambda _: last, "invalid": invalid}[how]
    rig.until_state("safe_hold", 0.1)
    lost = rig.ticks
    assert lost - before <= 55
    cause = {"silent": "no estimate", "old": "ms old", "invalid": "covariance too large"}[how]
    rig.run(0.3)
    assert rig.force[-1] == 0.0
    assert rig.status.state == "safe_hold"
    assert cause in rig.status.reason
    assert "Line" in rig.status.reason
    rig.run(0.3)
    assert max(rig.force[lost + 300 :]) == 0.0
    with pytest.raises(ValueError, match="cannot resume yet"):
        rig.arm.resume()
    assert rig.arm.state == "safe_hold"

    rig.sense = lambda estimate: estimate
    rig.run(0.01)
    rig.arm.resume()
    rig.until_state("finished", 5.0)
    assert_line_drawn(rig)


def assert_line_drawn(rig: Rig, within: float = 4e-4) -> None:
    """The 30 mm line at 225 deg from the first contact is drawn; ``within`` is in metres."""
    tip, force = np.array(rig.tip), np.array(rig.force)
    drawn = tip[force > 0.5, :2]
    start = rig.tip[20][:2]  # the approach is straight
    along = np.array([np.cos(np.radians(225)), np.sin(np.radians(225))])
    s = (drawn - start) @ along
    across = (drawn - start) @ np.array([-along[1], along[0]])
    assert np.abs(across).max() < within
    assert s.min() > -within
    assert s.max() == pytest.approx(0.03, abs=within)
    gaps = np.diff(np.sort(s))
    assert gaps.max() < 5e-4


def test_estimate_lost_while_letting_go_still_releases_the_board() -> None:
    """The node after the stroke presses nothing, but its pen is still on the board."""
    rig = drawing()
    rig.until(lambda: rig.status.node == "Away")
    assert rig.force[-1] > 0.5
    rig.sense = silent
    rig.until_state("safe_hold", 0.1).run(0.4)
    assert rig.force[-1] == 0.0


def test_start_without_an_estimate_is_refused_and_moves_nothing() -> None:
    """A program is not started blind; with sight it runs."""
    rig = at_rest()
    rig.sense = silent
    rig.run(0.01)
    with pytest.raises(ValueError, match="no valid estimate"):
        rig.arm.start(program(STROKE))
    rig.run(0.5)
    assert rig.arm.state == "idle"
    assert np.ptp(np.array(rig.tip)[20:], axis=0).max() < 1e-3
    rig.sense = lambda estimate: estimate
    rig.run(0.01)
    rig.arm.start(program(STROKE))
    rig.until_state("finished", 5.0)
    assert_line_drawn(rig)


def test_start_before_the_first_arm_state_runs_the_program() -> None:
    """An executive told to start before it ever saw the arm starts with the first state."""
    rig = Rig(world_at(NEAR, mismatch=EXACT))
    rig.run(0.001)
    rig.arm.start(program(STROKE))
    rig.run(0.05)
    assert (rig.arm.state, rig.status.node) == ("running", "Approach")


def test_gap_in_the_arm_state_interrupts_and_can_be_resumed() -> None:
    """After a gap the reference starts anew where the arm is, and a person goes on."""
    rig = drawing()
    rig.deaf = True
    rig.run(0.1)
    assert rig.arm.state == "running"  # it does not know yet
    rig.deaf = False
    rig.run(0.002)
    assert rig.arm.state == "safe_hold"
    assert "late" in rig.arm.reason
    rig.run(0.4)
    assert rig.force[-1] == 0.0
    rig.arm.resume()
    rig.until_state("finished", 5.0)
    assert_line_drawn(rig, within=6e-4)  # the brakes closed on a pen that moved


# --- requests -------------------------------------------------------------------------------


def test_pause_and_resume_finish_the_line() -> None:
    """Paused, the pen is off the board; resumed, the line goes on where it ended."""
    rig = drawing()
    rig.arm.pause()
    rig.run(0.4)
    assert rig.status.state == "paused"
    assert "Line" in rig.status.reason
    assert rig.force[-1] == 0.0
    rig.arm.resume()
    rig.until_state("finished", 5.0)
    assert_line_drawn(rig)


def test_stop_lets_go_and_leaves_the_arm_ready() -> None:
    """After a stop the pen is off the board and another program may start."""
    rig = drawing()
    rig.arm.stop()
    rig.run(0.4)
    assert (rig.status.state, rig.force[-1]) == ("idle", 0.0)
    rig.arm.start(program(STROKE))
    rig.run(0.01)
    assert rig.arm.state == "running"


@pytest.mark.parametrize("how", ["stop", "protective_stop"])
def test_stop_right_after_a_pause_still_lets_go(how: str) -> None:
    """A second request does not cut the retreat of the first one short."""
    rig = drawing()
    rig.arm.pause()
    rig.run(0.01)
    assert rig.force[-1] > 0.5
    if how == "stop":
        rig.arm.stop()
    else:
        rig.arm.protective_stop("asked for")
    rig.run(0.4)
    assert rig.force[-1] == 0.0


def test_requests_out_of_place_are_refused_with_the_reason() -> None:
    """Start while running, resume while running, pause while idle, reset while fine."""
    rig = at_rest()
    with pytest.raises(ValueError, match="no program is running"):
        rig.arm.pause()
    with pytest.raises(ValueError, match="not in protective stop"):
        rig.arm.reset()
    with pytest.raises(ValueError, match="nothing to resume"):
        rig.arm.resume()
    rig.arm.start(program(STROKE))
    rig.run(0.01)
    with pytest.raises(ValueError, match="running; possible now: pause, abort, stop"):
        rig.arm.start(program(STROKE))
    rig.arm.protective_stop("a person pressed the button")
    for request in (rig.arm.stop, lambda: rig.arm.start(program(STROKE))):
        with pytest.raises(ValueError, match="a person pressed the button"):
            request()


# --- limits ---------------------------------------------------------------------------------


def goto(x: float = 0.0, y: float = 0.0, z: float = 30.0, speed: float = 100.0) -> Program:
    """A program that goes to a point over the board [mm, mm/s]."""
    return program(
        f"INTERFACE = r1; INITIAL = Go; BEGIN NAME = Go; TYPE = Goto_pose; X = {x}; Y = {y}; "
        f"Z = {z}; Speed = {speed}; TRANSITION[Finished] = End; END"
    )


def stopped(rig: Rig, name: str, limit: float = 5.0) -> Rig:
    """Run into a protective stop, and check that it names the limit."""
    rig.until_state("protective_stop", limit).run(0.03)
    assert name in rig.status.reason
    return rig


def resets(rig: Rig) -> None:
    """Reset leads out, and the arm can work again."""
    rig.arm.reset()
    rig.run(0.05)
    assert rig.arm.state == "idle", rig.arm.reason
    rig.arm.start(
        program(
            "INTERFACE = r1; INITIAL = H; BEGIN NAME = H; TYPE = Hold; "
            "Time = 20 ms; TRANSITION[Timeout] = End; END"
        )
    )
    rig.until_state("finished", 1.0)


def test_force_limit_stops_and_lets_go() -> None:
    """Pushed into the board while the estimate stands still, the arm stops by the name of the
    force limit, and is off the board 0.3 s later.

    The pen's spring is at its end at about 18 N; from there on the force jumps. The
    push is over by then: no retreat outruns a platform that is pushed on.
    """
    push = {"kind": "push", "t": 0.75, "duration": 0.05, "force": 1500.0, "on": "platform"}
    world = world_at(NEAR, mismatch=EXACT)
    rig = drawing(
        0.002, world.model_copy(update={"disturbance": Scenario(disturbance=(push,)).disturbance})
    )
    assert rig.now < 0.75  # with an estimate that sees the push the arm would yield
    rig.sense = lambda e: replace(e, pose=np.zeros(3), velocity=np.zeros(3))
    stopped(rig, "force limit at the wrist", 2.0)
    assert rig.arm.state == "protective_stop"
    rig.run(0.3)
    assert max(rig.force[-50:]) == 0.0


def test_force_reading_stops_by_name_and_reset_leads_out() -> None:
    """70 N at the load cell stop the arm; as long as they act a reset does not help."""
    rig = at_rest()
    rig.alter = lambda s: replace(s, wrench=np.array([70.0, 0, 0, 0, 0, 0]))
    stopped(rig, "force limit at the wrist: 70 N of 60 N", 0.1)
    rig.arm.reset()
    rig.run(0.01)
    assert rig.arm.state == "protective_stop"
    rig.alter = lambda s: s
    resets(rig)


def test_velocity_limit_stops_by_name() -> None:
    """A joint that is faster than its limit stops the arm, and the joint is named."""
    rig = at_rest()
    rig.alter = lambda s: replace(s, qd=np.array([0, 0, 0, 0, 3.3, 0]))
    stopped(rig, "velocity limit of joint5", 0.2)
    rig.alter = lambda s: s
    resets(rig.run(0.1))


def test_tracking_limit_stops_by_name() -> None:
    """A joint that is far from where it should be stops the arm, and the joint is named."""
    rig = at_rest()
    rig.alter = lambda s: replace(s, q=s.q + np.array([0, 0, 0.2, 0, 0, 0]))
    stopped(rig, "tracking limit of joint3", 0.1)
    rig.alter = lambda s: s
    rig.run(0.05)
    resets(rig)


@pytest.mark.parametrize(
    ("at_limit", "name"),
    [("saturated", "torque limit"), ("clamped", "velocity limit of the reference")],
)
def test_standing_at_a_limit_for_long_stops_by_name(at_limit: str, name: str) -> None:
    """Torque or reference may be clamped for 0.1 s, also again and again, but not for longer."""
    model = ArmModel("xr4000_puma560")
    limits = Limits(model)
    q = np.array(model.robot.arm.rest)

    def tick(there: bool) -> str | None:
        flags = {"saturated": False, "clamped": False, at_limit: there}
        return limits.violated(0.001, q, np.zeros(6), q, np.zeros(6), reach_margin=None, **flags)

    for _ in range(5):
        assert not any(tick(True) for _ in range(95))
        assert tick(False) is None
    said = [tick(True) for _ in range(110)]
    assert str(said[-1]).startswith(name)


def test_reach_limit_stops_by_name_and_the_arm_comes_back() -> None:
    """Asked beyond its reach, the arm stops before it is straight; after a reset it returns."""
    rig = at_rest(world_at(1.4, mismatch=EXACT))
    rig.arm.start(goto(z=200.0, speed=300.0))
    stopped(rig, "reach limit")
    assert rig.status.reach_margin > -0.01
    rig.arm.reset()
    rig.run(0.05)
    assert rig.arm.state == "idle", rig.arm.reason
    rig.arm.start(goto(z=500.0, speed=100.0))
    rig.until_state("finished", 5.0)


def test_joint_limit_stops_by_name_and_the_arm_comes_back() -> None:
    """Pushed to the end of a joint's range the arm stops; after a reset it may move away."""
    push = {"kind": "push", "t": 0.3, "duration": 0.3, "force": 150.0, "on": "link5"}
    world = world_at(0.7, mismatch=EXACT)
    rig = at_rest(
        world.model_copy(update={"disturbance": Scenario(disturbance=(push,)).disturbance})
    )
    rig.arm.model.q_upper[2] = rig.sim.physics.q[2] + 0.03
    stopped(rig, "joint limit: joint")
    rig.run(0.5)
    rig.arm.reset()
    rig.run(0.05)
    assert rig.arm.state == "idle", rig.arm.reason
    rig.arm.start(goto(z=100.0))
    rig.until_state("finished", 5.0)


def test_why_one_try_failed_is_forgotten_with_the_next() -> None:
    """A program that comes back to a node it has been in says no more what led there before."""
    rig = at_rest()
    rig.arm.start(
        program("""
INTERFACE = r1; INITIAL = Try;
BEGIN NAME = Try; TYPE = Hold; Time = 50 ms; TRANSITION[Timeout] = Away; END
BEGIN NAME = Away; TYPE = Hold; Time = 50 ms; TRANSITION[Timeout] = Wait;
    TRANSITION[Force > 5000] = End; END
BEGIN NAME = Wait; TYPE = Hold; Time = 50 ms; TRANSITION[Timeout] = Away; END
""")
    )
    rig.run(0.05).until(lambda: rig.status.node == "Away")
    rig.arm._cause = "stuck"
    rig.until(lambda: rig.status.node == "Wait")
    assert rig.arm._cause == "stuck"
    rig.until(lambda: rig.status.node == "Away")
    assert rig.arm._cause == ""


def ends_ahead(rig: Rig, joint: int, ahead: float) -> None:
    """Let a joint's range end so far beyond where it is [rad], whichever side it goes to."""
    model, q = rig.arm.model, rig.sim.physics.q[joint]
    model.q_lower[joint], model.q_upper[joint] = q - ahead, q + ahead


def test_wrist_at_the_end_of_its_range_gives_way_and_the_tip_does_not() -> None:
    """A way that asks for more of joint 5 than it has is gone to its end, the tool leaning."""
    rig = at_rest(world_at(0.7, mismatch=EXACT))
    ends_ahead(rig, 4, 0.1)
    rig.arm.start(goto(z=40.0))
    rig.until_state("finished", 5.0)
    assert 0.04 < min(s.joint_margin for s in rig.statuses) < 0.07
    off = np.linalg.norm(rig.tip[-1] - rig.desired[-1])
    assert off < 1e-3


def test_way_that_would_lay_the_tool_down_is_interrupted_and_the_joint_named() -> None:
    """It holds still with a reason, far from a limit that would stop the arm."""
    rig = at_rest(world_at(0.7, mismatch=EXACT))
    ends_ahead(rig, 2, 0.1)
    rig.arm.start(goto(z=60.0))
    rig.until_state("safe_hold", 5.0).run(0.05)
    assert "the tool leans by 11 deg, with joint3 near the end of range" in rig.status.reason
    assert min(s.joint_margin for s in rig.statuses) > 0.04


def test_unexpected_push_on_a_link_stops_or_is_carried() -> None:
    """A hard push on the forearm ends in a protective stop with a limit's name."""
    push = {
        "kind": "push",
        "t": 0.1,
        "duration": 1.0,
        "force": 400.0,
        "direction": 90.0,
        "on": "link5",
    }
    world = world_at(0.7, mismatch=EXACT)
    rig = Rig(world.model_copy(update={"disturbance": Scenario(disturbance=(push,)).disturbance}))
    rig.until_state("protective_stop", 1.0).run(0.03)
    assert "limit" in rig.status.reason
