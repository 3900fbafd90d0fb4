"""One trial of the grasp: runs a variant in lockstep, pushes at a phase of the task, records.

Phases are told by the truth, the same for every variant: what a variant believes would have each
pushed at another moment.
"""

from __future__ import annotations

import gc
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from services.components import build_service
from services.lockstep import Lockstep
from services.messages import ArmStatus, Estimate, Message, ObjectEstimate, Truth
from services.topics import ARM_STATUS, ESTIMATE, OBJECT, SERVICES, TRUTH, Topic
from sim.scenario import Scenario

Array = NDArray[np.float64]

PUSH_TIME = 0.1
"""[s]"""
BODIES = {"arm": ("left_link4", "right_link4"), "base": ("platform",), "box": ("box",)}
"""What is pushed; of two, either."""
PHASES = ("reach", "touch", "grip", "lift")
"""Moments of the task: palms near the line; both touch; both press; the box is up 5 cm."""
PALMS = ("left_palm", "right_palm")


@dataclass(frozen=True)
class Shove:
    """A push of ``PUSH_TIME`` at a phase, horizontally in a direction drawn from the seed.

    Attributes:
        on: one of ``BODIES``.
        phase: one of ``PHASES``.
        impulse: [N s].
    """

    on: str
    phase: str
    impulse: float


@dataclass
class Recorded:
    """What a trial said, thinned: truth at 125 Hz, statuses, estimates of box and platform.

    Attributes:
        pushed: when the push began [s], None without.
    """

    truth: list[Truth] = field(default_factory=list)
    status: list[ArmStatus] = field(default_factory=list)
    box: list[ObjectEstimate] = field(default_factory=list)
    poses: dict[int, Array] = field(default_factory=dict)
    pushed: float | None = None

    def hear(self, topic: Topic[Any], message: Message, now: float) -> None:
        """Keep what the figures need."""
        if topic is TRUTH:
            assert isinstance(message, Truth)
            self.truth.append(message)
        elif topic is ARM_STATUS:
            assert isinstance(message, ArmStatus)
            self.status.append(message)
        elif topic is OBJECT:
            assert isinstance(message, ObjectEstimate)
            self.box.append(message)
        elif topic is ESTIMATE:
            assert isinstance(message, Estimate)
            self.poses[round(message.t * 1000)] = message.pose


def run_trial(scenario: Scenario, seed: int, hold: float, shove: Shove | None = None) -> Recorded:
    """Run until the program has ended, or the box has been held for a while.

    Args:
        scenario: with the variant's program.
        seed: of everything random.
        hold: how long the box is held, of what the program holds it [s].
        shove: a push.

    Raises:
        BadFile, ProgramError: the scenario or its program is wrong.
    """
    log = Recorded()
    services = [build_service(name, scenario, seed) for name in SERVICES]
    lockstep = Lockstep(services, listener=log.hear)
    rng = np.random.default_rng([seed, 7])
    body, direction = "", 0.0
    if shove is not None:
        body = str(rng.choice(BODIES[shove.on]))
        direction = float(rng.uniform(-180.0, 180.0))
    held: float | None = None
    end = math.inf
    was = gc.isenabled()
    gc.disable()
    try:
        while lockstep.now < min(scenario.duration, end):
            lockstep.step()
            if lockstep.tick % 8 or not log.truth or not log.status:
                continue
            last = log.status[-1]
            if shove is not None and log.pushed is None and due(shove.phase, log.truth[-1]):
                log.pushed = lockstep.now
                options = {
                    "force": shove.impulse / PUSH_TIME,
                    "duration": PUSH_TIME,
                    "direction": direction,
                    "on": body,
                }
                services[0].prepare("disturb", {"kind": "push", **options})()
            held = (held or lockstep.now) if last.node == "Hold" else None
            if end == math.inf and (
                last.state in ("finished", "protective_stop", "safe_hold")
                or (held is not None and lockstep.now - held >= hold)
            ):
                end = lockstep.now + 0.1
    finally:
        if was:
            gc.enable()
    return log


def due(phase: str, truth: Truth) -> bool:
    """Whether a phase has come."""
    if phase == "touch":
        return least_force(truth) > 2.0
    if phase == "grip":
        return least_force(truth) > 20.0
    if phase == "lift":
        return least_force(truth) > 10.0 and truth.bodies["box"][2] > 0.839 + 0.05
    return from_line(truth) < 0.08


def least_force(truth: Truth) -> float:
    """Of both palms, on the one that is pressed less [N]."""
    return min(math.hypot(*truth.forces[name]) for name in PALMS)


def from_line(truth: Truth) -> float:
    """Of the palm that is farther from the line across the box, through its middle, between the
    faces they are nearer to [m]."""
    R, box = turned(truth.bodies["box"]), np.array(truth.bodies["box"][:3])
    offsets = [R.T @ (np.array(truth.bodies[name][:3]) - box) for name in PALMS]
    return min(max(math.hypot(o[axis], o[2]) for o in offsets) for axis in (0, 1))


def turned(pose: list[float]) -> Array:
    """R_WX of a pose as in ``Truth.bodies``, shape (3, 3)."""
    w, x, y, z = pose[3:]
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
