"""Near a singular wrist the arm slows and then refuses with a reason; the torques never jump."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from arm.control import Orientation, Position
from arm.control.priority import Solution, priorities, solve
from arm.control.torque_law import TorqueLaw
from arm.executive import REFUSED, SLOWED
from arm.model import STANDING, ArmModel
from arm.nodes.node import Context
from arm.nodes.profile import Profile
from arm.reference import JointReference
from services.messages import Array
from tests.arm.rig import Rig, program, world_at

STRAIGHT: Array = np.array([0.28, -1.38, -0.13, 1.75, 0.29, -1.75])
"""A posture from which turning the tool takes joint 5 through 0, where the wrist is straight."""


def crossing(ticks: int) -> tuple[Array, list[Solution], Array]:
    """Turn the tool so that joint 5 crosses 0; torques, solutions and joint 5, tick by tick."""
    model = ArmModel("xr4000_puma560")
    here = model.place(STANDING, STRAIGHT, np.zeros(6))
    position, orientation = Position(np.eye(3)), Orientation(here.R.copy())
    position.track(here.p, np.zeros(3))
    axis = here.J[3:, 4]  # of joint 5
    free = np.full(6, np.inf)
    reference, law = JointReference(free, -free, free), TorqueLaw(model)
    reference.reset(STRAIGHT)
    out, solutions, angles = [], [], []
    for tick in range(ticks):
        reference.advance(0.001)
        here = model.place(STANDING, reference.q, reference.qd)
        # 0.4 rad/s about that axis, and a little about another one: the wrist must turn over
        speed = 0.4 * min(tick / 300, 1.0)
        turn = -speed * axis + 0.02 * speed * np.cross(axis, here.R[:, 2])
        rows = [p.rows(here, 0.001) for p in orientation.subject_to(position).parts()]
        rows[1] = replace(rows[1], rate=turn)
        solutions.append(priorities(rows, 6))
        reference.follow(solutions[-1].qd, 0.001)
        args = (reference.q, reference.qd, reference.q, reference.qd, STANDING, here, np.zeros(3))
        out.append(law.torque(0.001, *args))
        angles.append(reference.q[4])
    return np.array(out), solutions, np.array(angles)


def test_crossing_a_straight_wrist_is_smooth() -> None:
    """Even carried through it by the platform, no wrist torque steps by more than 3 N m in 1 ms.

    A plain inverse stepped by 373 N m there.
    """
    torque, solutions, joint5 = crossing(2500)
    assert joint5.max() > 0.2 and joint5.min() < -0.05  # it does cross
    assert min(s.manipulability for s in solutions) < 0.01
    assert np.abs(np.diff(torque[:, 3:], axis=0)).max() < 3.0
    assert np.abs([s.qd for s in solutions]).max() < 20.0


def test_manipulability_of_the_wrist_is_its_angle() -> None:
    """Where the arm refuses, joint 5 is less than 0.1 rad from straight, and more than 0.05."""
    model = ArmModel("xr4000_puma560")
    values = []
    for angle in (0.2, 0.1, 0.05):
        q = STRAIGHT.copy()
        q[4] = angle
        here = model.place(STANDING, q, np.zeros(6))
        position, orientation = Position(np.eye(3)), Orientation(here.R)
        rows = [p.rows(here, 0.001) for p in orientation.subject_to(position).parts()]
        values.append(priorities(rows, 6).manipulability)
        assert np.isfinite(solve(rows, 6)).all()
    assert values[0] > SLOWED > values[1] > REFUSED > values[2]


def test_pace_slows_a_way_and_never_jumps_ahead() -> None:
    """At half the pace a way takes twice as long, and its speed is what it says."""
    way, there = Profile(0.1, 0.05, 0.1), []
    context = Context.__new__(Context)
    context.dt, context.pace = 0.001, 0.5
    speeds = []
    for _ in range(3000):
        s, v = context.along(way)
        there.append(s)
        speeds.append(v)
    np.testing.assert_allclose(np.diff(there), 0.001 * np.array(speeds[1:]), atol=2e-8)
    assert max(speeds) <= 0.025 + 1e-12


def test_program_near_a_singular_posture_is_interrupted_with_the_reason() -> None:
    """What the arm would have to turn over for it does not try; a person is told why."""
    rig = Rig(world_at(2.0))
    rig.run(0.05)
    rig.arm.start(
        program("""
INTERFACE = r1;
INITIAL = Stay;
BEGIN
    NAME = Stay;
    TYPE = Hold;
    Time = 60 s;
    TRANSITION[Timeout] = End;
END
""")
    )
    rig.run(0.05)
    assert rig.arm.state == "running"
    rig.arm._mind(0.5 * (SLOWED + REFUSED), [])
    assert 0.0 < rig.arm._pace < 1.0 and rig.arm.state == "running"
    rig.arm._mind(0.04, [])
    assert rig.arm._pace == 0.0
    assert rig.arm.state == "safe_hold"
    assert "singular posture: manipulability 0.040" in rig.arm.reason
