"""The simulated robot as a service."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from deploy.robot import robot_kind
from services import messages as m
from services.service import Inbox, Outbox, Reply
from services.topics import (
    ARM_COMMAND,
    ARM_STATE,
    BASE_COMMAND,
    BUMPER,
    HAND_COMMAND,
    HAND_STATE,
    IMU,
    ODOMETRY,
    SCAN,
    TRUTH,
    VISION,
    Topic,
)
from sim.disturbance import disturbance_from
from sim.hand_simulator import HAND_JOINTS, HandSimulator
from sim.scenario import Scenario
from sim.simulator import Simulator
from sim.two_arm_simulator import TwoArmSimulator


class SimService:
    """The simulated robot, of whichever kind the scenario's robot is."""

    name = "sim"
    inputs: tuple[Topic, ...] = (ARM_COMMAND, BASE_COMMAND)
    """And ``HAND_COMMAND`` of a robot with a hand."""
    verbs: tuple[str, ...] = ("disturb",)
    _topic: ClassVar[dict[type[m.Message], Topic]] = {
        m.ArmState: ARM_STATE,
        m.HandState: HAND_STATE,
        m.Odometry: ODOMETRY,
        m.Imu: IMU,
        m.Scan: SCAN,
        m.Bumper: BUMPER,
        m.Vision: VISION,
        m.Truth: TRUTH,
    }

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.simulator: Simulator | TwoArmSimulator | HandSimulator
        kind = robot_kind(scenario.robot)
        if kind == "hand":
            self.simulator = HandSimulator(scenario, seed)
            self.inputs = (ARM_COMMAND, HAND_COMMAND, BASE_COMMAND)
        elif kind == "two_arm":
            self.simulator = TwoArmSimulator(scenario, seed)
        else:
            self.simulator = Simulator(scenario, seed)
        self.period = self.simulator.period
        self._joints = self.simulator.joints
        self._refused = 0
        self._now = 0.0

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Publish what the robot senses at ``now``, then advance it by its period."""
        self._now = now
        arm, base = inbox.latest(ARM_COMMAND), inbox.latest(BASE_COMMAND)
        if arm is not None and not arm.of(self._joints):
            self._refused = len(arm.tau)
            arm = None  # as good as silence: the motors brake
        if isinstance(self.simulator, HandSimulator):
            hand = inbox.latest(HAND_COMMAND)
            if hand is not None and not hand.of(HAND_JOINTS):
                self._refused, hand = len(hand.tau), None
            out = self.simulator.step(now, arm, hand, base)
        else:
            out = self.simulator.step(now, arm, base)
        return [(self._topic[type(x)], x) for x in out]

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """``disturb``: kind and its options."""
        options = dict(args)
        kind = str(options.pop("kind", ""))
        made = disturbance_from(kind, options, self._now, self.simulator.timeline.bodies)
        self.simulator.timeline.refuse(made)

        def act() -> Reply:
            self.simulator.timeline.add(made, self._now)
            return Reply(True, f"{kind} from t = {made.t:.3f} s")

        return act

    def state(self) -> tuple[str, str]:
        """Running, and what is wrong with what it is told."""
        if self._refused:
            return "running", f"refused a command of {self._refused} torques, not {self._joints}"
        return "running", ""
