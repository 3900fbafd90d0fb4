"""Joints that come too near an end of their range stop two arms, and an arm with a hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from arm.grasping.nodes import REGISTRY as GRASP
from arm.hand.nodes import REGISTRY as HAND
from arm.hds import Registry, check_text
from arm.joint_limits import CLEAR, JOINT_MARGIN, JointLimits
from services.components import build_service
from services.lockstep import TICK, Lockstep
from services.messages import ArmState, ArmStatus
from services.topics import ARM_STATE, ARM_STATUS
from sim.scenario import load_scenario


def test_a_joint_that_keeps_to_its_rates_comes_to_rest_in_its_range() -> None:
    """However fast it is asked to go, either way; and nothing is asked of one in the middle."""
    limits = JointLimits(("a", "b"), np.array([-1.0, -1.0]), np.array([1.0, 1.0]), (9.0, 9.0))
    q = np.array([0.0, 0.0])
    fastest, wanted = 0.0, np.array([5.0, -5.0])
    for _ in range(2000):
        ends = limits.ends(q)
        rates = np.minimum(np.maximum(wanted, ends.lowest), ends.highest)
        fastest = max(fastest, float(rates[0]))
        q = q + 0.004 * rates
    np.testing.assert_allclose(q, [1.0 - CLEAR, CLEAR - 1.0], atol=1e-3)
    assert fastest > 2.0
    assert not limits.ends(np.zeros(2)).push.any()


def test_what_is_pushed_beyond_is_pushed_back_as_by_an_end_stop() -> None:
    """The more, the nearer it is to the very end; rates lead back as well."""
    limits = JointLimits(("a",), np.array([-1.0]), np.array([1.0]), (9.0,))
    half, end, beyond = (limits.ends(np.array([q])) for q in (1.0 - CLEAR / 2, 1.0, 1.2))
    np.testing.assert_allclose([half.push[0], end.push[0], beyond.push[0]], [-0.5, -1.0, -1.0])
    assert half.highest[0] < 0.0
    assert limits.ends(np.array([-1.0])).push[0] == 1.0


class Robot:
    """Simulator, observer and arm on one clock; nothing is started by itself."""

    def __init__(self, scenario: str, start: tuple[float, float, float] | None = None) -> None:
        made = load_scenario(scenario)
        world = {} if start is None else {"start": None, "platform_start": start}
        made = made.model_copy(
            update={
                "task": made.task.model_copy(update={"autostart": False}),
                "world": made.world.model_copy(update=world),
            }
        )
        services: list[Any] = [build_service(name, made, 1) for name in ("sim", "observer", "arm")]
        self._sim, self.arm = services[0], services[2].executive
        self._lockstep = Lockstep(services, listener=self._hear)
        self.status: ArmStatus
        self.q = np.zeros(0)

    def _hear(self, topic: object, message: Any, now: float) -> None:
        if topic is ARM_STATE:
            assert isinstance(message, ArmState)
            self.q = message.q
        elif topic is ARM_STATUS:
            self.status = message

    def run(self, seconds: float) -> None:
        """Run for a time."""
        for _ in range(round(seconds / TICK)):
            self._lockstep.step()

    def until(self, condition: Callable[[], bool], limit: float) -> None:
        """Run until ``condition`` holds; AssertionError if it does not within ``limit`` [s]."""
        for _ in range(round(limit / TICK)):
            if condition():
                return
            self._lockstep.step()
        raise AssertionError(f"still {self.arm.states} after {limit} s")

    def push(self, on: str, direction: float, force: float) -> None:
        """For 0.6 s."""
        given = {"force": force, "duration": 0.6, "direction": direction, "on": on}
        self._sim.prepare("disturb", {"kind": "push", **given})()

    def start(self, node: str, registry: Registry) -> None:
        """Run a program of one node, whose every event is the end."""
        ends = "".join(
            f"TRANSITION[{e.name}] = End; " for e in registry[node].events if not e.needs
        )
        text = f"INTERFACE = r; INITIAL = A; BEGIN NAME = A; TYPE = {node}; {ends}END"
        made, findings = check_text(text, "test.hds", registry)
        assert made is not None, findings
        self.arm.start(made)


def test_two_arms_pushed_to_a_joint_s_end_stop_by_its_name_and_come_back() -> None:
    """Off the very end, but no farther, also after a reset, until a program takes them away."""
    robot = Robot("reach_to_grasp")
    robot.until(lambda: bool(robot.arm.sees), 1.0)
    robot.push("left_link4", -90.0, 320.0)
    robot.until(lambda: bool(robot.arm.state == "protective_stop"), 0.6)
    robot.run(1.0)  # the push is over
    assert robot.status.reason.startswith("joint limit: left_joint2 has ")
    assert JOINT_MARGIN < robot.status.joint_margin < CLEAR + JOINT_MARGIN
    robot.arm.reset()
    robot.run(0.2)
    assert robot.arm.state == "idle", robot.arm.reason
    assert JOINT_MARGIN < robot.status.joint_margin < CLEAR + JOINT_MARGIN
    robot.start("Grasp_rest", GRASP)
    robot.until(lambda: bool(robot.arm.state == "finished"), 8.0)
    robot.run(0.03)
    assert robot.status.event == "Rested"
    assert robot.status.joint_margin > 0.4


def test_an_arm_with_a_hand_pushed_to_a_joint_s_end_stops_by_its_name_and_comes_back() -> None:
    """As two arms; its joints are stiffer, so the end is put near where the push takes one."""
    robot = Robot("pick_bottle", start=(-0.55, -0.28, 0.05))
    robot.until(lambda: bool(robot.arm.sees), 1.0)
    robot.arm.hand.model.upper[3] = robot.q[3] + 0.06
    robot.push("link6", 180.0, 250.0)
    robot.until(lambda: bool(robot.arm.state == "protective_stop"), 0.6)
    robot.run(1.0)
    assert robot.status.reason.startswith("joint limit: joint4 has ")
    assert robot.status.joint_margin < JOINT_MARGIN
    robot.arm.reset()
    robot.run(0.2)
    assert robot.arm.state == "idle", robot.arm.reason
    assert robot.status.joint_margin < JOINT_MARGIN
    robot.start("Hand_reach", HAND)
    robot.until(lambda: bool(robot.arm.state == "finished"), 5.0)
    robot.run(0.03)
    assert robot.status.event == "Reached"
    assert robot.status.joint_margin > 0.4


def limits(patience: float = 0.0) -> JointLimits:
    """Of two joints that end at 1 rad and may turn at 2 rad/s."""
    return JointLimits(["a", "b"], np.full(2, -1.0), np.full(2, 1.0), [2.0, 2.0], patience)


@pytest.mark.parametrize(("q", "joint"), [((0.0, 0.99), "b"), ((-0.99, 0.0), "a")])
def test_the_joint_that_is_too_near_its_end_is_named(q: tuple[float, float], joint: str) -> None:
    """At either end, with what is left."""
    said = limits().violated(0.001, np.array(q), np.zeros(2))
    assert said == f"joint limit: {joint} has 0.010 rad left of 0.02 rad"


def test_an_excused_joint_may_come_back_but_go_no_further() -> None:
    """And once it is back it is not excused any more."""
    watch = limits()
    watch.excuse()

    def at(q: float) -> str | None:
        return watch.violated(0.001, np.array([q, 0.0]), np.zeros(2))

    assert at(0.995) is None
    assert at(0.999) is None  # what it sags by
    assert at(1.001) is not None
    for q in np.linspace(0.999, 0.97, 30):
        assert at(q) is None
    assert at(0.985) is not None


def test_a_joint_may_be_too_fast_for_as_long_as_there_is_patience() -> None:
    """Again and again; without patience, for no longer than the speed is averaged over."""
    patient, strict = limits(0.1), limits()
    q, fast = np.zeros(2), np.array([0.0, 2.5])
    for _ in range(3):
        assert not any(patient.violated(0.001, q, fast) for _ in range(95))
        assert not any(patient.violated(0.001, q, np.zeros(2)) for _ in range(50))
    assert any(patient.violated(0.001, q, fast) for _ in range(120))
    said = [strict.violated(0.001, q, fast) for _ in range(30)]
    assert said[0] is None
    assert str(said[-1]).startswith("velocity limit of b: ")
