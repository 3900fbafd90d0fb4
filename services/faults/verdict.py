"""What is judged of a run with faults: limits, how it ended, how soon it was safe.

Truth is used: nothing here is part of the robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from arm.model import ArmModel
from services.faults import kinds as k
from services.lockstep import TICK
from services.messages import AT_WORK, ArmState, ArmStatus, Message, Truth
from services.topics import ARM_STATE, ARM_STATUS, TRUTH, Topic
from sim.disturbance import Push, Slip, Timed

_INPUTS = {"observer/estimate": "arm", "robot/arm_state": "arm", "arm/command": "sim"}
"""What the arm, or its motors, must not go without; and who hears it."""
FORCED = 1.0
"""After a push or slip the platform's speed is the pusher's for this long [s]."""


@dataclass
class Limits:
    """Largest share of each limit that was used, and for how long one was left unstopped.

    Attributes:
        used: share of the limit by its name; above 1 it was left.
        left: longest time that a limit was left without a protective stop [s].
    """

    used: dict[str, float] = field(default_factory=dict)
    left: float = 0.0


class Witness:
    """Listens to a run with faults; it sees the truth and steers nothing.

    Args:
        robot: name of the robot's folder in deploy/robots.
        world: disturbances of the world.
    """

    def __init__(self, robot: str, world: list[Timed]) -> None:
        model = ArmModel(robot)
        arm = model.robot.arm
        self._torque, self._speed = np.array(arm.torque_limit), np.array(arm.velocity_limit)
        self._lower, self._upper = model.q_lower, model.q_upper
        self._force = arm.force_limit
        self._platform = np.array(model.robot.platform.speed_limit)
        self._pushed = [d.t for d in world if isinstance(d, Push | Slip)]
        self.limits = Limits()
        self.states: list[tuple[float, str, str]] = []
        """Instant, state and reason of the arm whenever they change."""
        self.braked: list[tuple[float, bool]] = []
        self._since: float | None = None

    def __call__(self, topic: Topic, message: Message, now: float) -> None:
        """Take a message into account."""
        if topic is TRUTH:
            self._truth(message, now)  # type: ignore[arg-type]
        elif topic is ARM_STATE:
            self._arm(message)  # type: ignore[arg-type]
        elif topic is ARM_STATUS:
            self._status(message, now)  # type: ignore[arg-type]

    def brakes(self, now: float, on: bool) -> None:
        """Whether the motors brake."""
        if not self.braked or self.braked[-1][1] != on:
            self.braked.append((now, on))

    def safe_after(self, fault: k.Fault) -> float | None:
        """How long after a fault began the arm was safe [s].

        Infinite if it never was as long as the fault lasted; None if it was not at work.
        """
        before = [s for t, s, _ in self.states if t < fault.t]
        held = [on for t, on in self.braked if t < fault.t]
        if not before or before[-1] not in AT_WORK or (held and held[-1]):
            return None
        stopped = [t for t, s, _ in self.states if t >= fault.t and s not in AT_WORK]
        braked = [t for t, on in self.braked if t >= fault.t and on]
        first = min((*stopped, *braked), default=math.inf)
        return math.inf if first > fault.t + fault.duration + 0.1 else first - fault.t

    def _status(self, status: ArmStatus, now: float) -> None:
        if not self.states or self.states[-1][1:] != (status.state, status.reason):
            self.states.append((now, status.state, status.reason))

    def _arm(self, state: ArmState) -> None:
        self._use("torque", float((np.abs(state.tau) / self._torque).max()))

    def _truth(self, truth: Truth, now: float) -> None:
        force = float(truth.recent[:, 3].max()) / self._force
        speed = float((np.abs(truth.qd) / self._speed).max())
        middle, half = 0.5 * (self._upper + self._lower), 0.5 * (self._upper - self._lower)
        joint = float((np.abs(truth.q - middle) / half).max())
        self._use("pen force", force)
        self._use("joint speed", speed)
        self._use("joint range", joint)
        platform = 0.0
        if not any(t <= now < t + FORCED for t in self._pushed):
            platform = float((np.abs(truth.velocity) / self._platform).max())
            self._use("platform speed", platform)
        self._unstopped(max(force, speed, joint, platform) > 1.0, now)

    def _unstopped(self, left: bool, now: float) -> None:
        stopped = bool(self.states) and self.states[-1][1] == "protective_stop"
        if not left or stopped:
            self._since = None
            return
        self._since = now if self._since is None else self._since
        self.limits.left = max(self.limits.left, now - self._since + TICK)

    def _use(self, name: str, share: float) -> None:
        self.limits.used[name] = max(self.limits.used.get(name, 0.0), share)


def starves(fault: k.Fault) -> bool:
    """Whether a fault takes from the arm, or from its motors, all of an input for long enough."""
    if fault.duration < 0.1:
        return False
    if isinstance(fault, k.Loss):
        reader = _INPUTS.get(fault.topic)
        return fault.share == 1.0 and reader is not None and fault.reader in ("", reader)
    return isinstance(fault, k.Hang | k.Death) and fault.service in ("observer", "arm")


def ended_well(states: list[tuple[float, str, str]]) -> tuple[bool, str]:
    """Whether the program finished or stated where it stopped, and in what words."""
    if not states:
        return False, "the arm never spoke"
    _, state, reason = states[-1]
    words = f"{state}: {reason}" if reason else state
    return state == "finished" or (state not in AT_WORK and bool(reason)), words


def told(fault: k.Fault | Timed) -> dict[str, Any]:
    """A fault as plain data, for the row of its trial."""
    if isinstance(fault, Timed):
        return fault.model_dump()
    return {"kind": fault.kind, **vars(fault)}
