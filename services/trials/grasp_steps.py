"""A trial of the grasp in which every controller is chosen from outside, one after the other.

The arms run ``grasp_actions.hds``; between two ticks it is paused, sent to another node and
resumed, which takes no time. What was run, from which state to which, and what harm it did, is the
result.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from arm.grasping.graph import ACTIONS, GOAL, LOST, Facts, state_of
from arm.grasping.regions import NAMES, Regions
from arm.grasping.scene import Scene
from services.components import build_service
from services.lockstep import Lockstep
from services.messages import ArmStatus, Message, Truth
from services.topics import ARM_STATUS, SERVICES, TRUTH, Topic
from services.trials.grasp_run import BODIES, PALMS, PUSH_TIME, turned
from services.two_arm_service import TwoArmService
from sim.scenario import Scenario

THROWN = 0.05
"""Outside an action's states for this long it is thrown out [s]."""
FORCE, TILT, DRAGGED, TABLE = 100.0, math.radians(20.0), 0.08, 0.6
"""Harm: a palm pushed harder [N], the box tilted [rad] or dragged farther [m], or below [m]."""
AFTER = 1.0
"""For so long after a push a palm's force is the push's doing [s]."""

Choose = Callable[[str], str]
"""Which controller in a state."""


@dataclass
class Watch:
    """The truth while a controller runs: what harm was done.

    Attributes:
        start: where the box was [m], shape (3,).
        free: forces up to here are not the controller's doing [s].
    """

    start: np.ndarray | None = None
    free: float = -1.0
    peak: float = 0.0
    tilt: float = 0.0
    dragged: float = 0.0
    low: float = math.inf
    status: ArmStatus = field(default_factory=lambda: ArmStatus(t=0.0))

    def hear(self, topic: Topic, message: Message, now: float) -> None:
        """Look at the truth and at the newest status; the other topics are let pass."""
        if topic is ARM_STATUS:
            assert isinstance(message, ArmStatus)
            self.status = message
        if topic is not TRUTH:
            return
        assert isinstance(message, Truth)
        pose = message.bodies["box"]
        p = np.array(pose[:3])
        self.start = p if self.start is None else self.start
        self.low = min(self.low, float(p[2]))
        self.tilt = max(self.tilt, math.acos(min(1.0, float(turned(pose)[2, 2]))))
        if now > self.free:
            force = max(math.hypot(*message.forces[name]) for name in PALMS)
            self.peak = max(self.peak, force)
            self.dragged = max(self.dragged, float(np.linalg.norm((p - self.start)[:2])))

    def harm(self, held: bool) -> str:
        """What harm was done, empty if none; a box that is held may go where the palms go."""
        if self.low < TABLE:
            return "off the table"
        if self.peak > FORCE:
            return "force"
        if self.tilt > TILT:
            return "tilt"
        return "dragged" if self.dragged > DRAGGED and not held else ""

    def reset(self) -> None:
        """Begin with the next controller."""
        self.start, self.peak, self.tilt, self.dragged = None, 0.0, 0.0, 0.0


@dataclass
class Episode:
    """What was run.

    Attributes:
        steps: state, action, next state, seconds, harm (a word, empty for none), of each.
        began: first decision [s]; ended: when the trial was over [s].
        pushed: when it was pushed [s], None if never.
    """

    steps: list[tuple[str, str, str, float, str]] = field(default_factory=list)
    began: float = 0.0
    ended: float = 0.0
    pushed: float | None = None

    @property
    def lifted(self) -> bool:
        """Whether the goal was reached."""
        return bool(self.steps) and self.steps[-1][2] == GOAL


class Seeing(Regions):
    """Regions that keep what they were shown, for whoever decides."""

    scene: Scene | None = None
    held = False

    def step(self, scene: Scene, held: bool) -> None:
        """Look at a tick, and keep it."""
        super().step(scene, held)
        self.scene, self.held = scene, held


def facts_of(regions: Seeing, rest: np.ndarray) -> Facts:
    """What the arms believe, as the graph's states need it.

    Args:
        regions: after a tick.
        rest: posture at rest, shape (14,) [rad].

    Raises:
        ValueError: there was no tick yet.
    """
    scene = regions.scene
    if scene is None:
        raise ValueError("the arms have not looked yet")
    inner = [name for name in NAMES if regions[name]]
    unstowed = float(np.abs(rest - scene.palms.q).max())
    touching = sum(scene.feel.touches)
    box = scene.box
    if box is None:
        return Facts(False, "", math.inf, 0.0, unstowed, touching, regions.held)
    bearing = math.atan2(float(box.p[1]), float(box.p[0]))
    angle = abs(math.remainder(bearing - box.approach, math.tau))
    distance = math.hypot(float(box.p[0]), float(box.p[1]))
    region = inner[-1] if inner else ""
    return Facts(True, region, distance, angle, unstowed, touching, regions.held)


def run_steps(
    scenario: Scenario, seed: int, choose: Choose, budget: float, push: tuple[float, float] | None
) -> Episode:
    """Let somebody choose, until the box is lifted, lost or harmed, or time is over.

    Args:
        scenario: with ``grasp_actions.hds`` for its program.
        seed: of everything random.
        choose: which controller in a state.
        budget: time after the first decision [s].
        push: of a forearm for 0.1 s in a direction drawn from the seed: how long after the first
            decision [s], impulse [N s].

    Raises:
        BadFile, ProgramError: the scenario or its program is wrong.
    """
    watch, out = Watch(), Episode()
    services = [build_service(name, scenario, seed) for name in SERVICES]
    arms = next(service for service in services if isinstance(service, TwoArmService))
    arms.executive.regions = regions = Seeing()
    lockstep = Lockstep(services, listener=watch.hear)
    rng = np.random.default_rng([seed, 7])
    body, direction = str(rng.choice(BODIES["arm"])), float(rng.uniform(-180.0, 180.0))
    rest = arms.executive.hands.posture.target.copy()
    while lockstep.now < scenario.duration and watch.status.node != "Decide":
        lockstep.step()
    if watch.status.node != "Decide":
        return out
    out.began = lockstep.now
    end = out.began + budget
    state, event = state_of(facts_of(regions, rest)), ""
    while lockstep.now < end and state not in (GOAL, LOST):
        name = choose(state)
        action = ACTIONS[name]
        if not (event and watch.status.node == action.node):  # it has gone on there by itself
            _send(arms, action.node)
        watch.reset()
        since = fired = lockstep.now
        count = watch.status.transitions
        outside, event = 0.0, ""
        while lockstep.now < min(since + action.limit, end):
            if push is not None and out.pushed is None and lockstep.now >= out.began + push[0]:
                out.pushed = lockstep.now
                watch.free = lockstep.now + AFTER
                shove = {"force": push[1] / PUSH_TIME, "duration": PUSH_TIME}
                at = {"kind": "push", "direction": direction, "on": body}
                services[0].prepare("disturb", {**shove, **at})()
            lockstep.step()
            fired = lockstep.now
            if arms.executive.state != "running":
                break
            if watch.status.transitions > count:
                event = watch.status.event
                break
            now = state_of(facts_of(regions, rest))
            inside = now == state or now in action.domain or now in action.through
            outside = 0.0 if inside else outside + 0.001
            if outside > THROWN:
                break
        after = state_of(facts_of(regions, rest))
        if arms.executive.state != "running":
            after = LOST
        elif event == "Lifted":
            after = GOAL
        harm = watch.harm(regions.held) or (
            "stop" if arms.executive.state == "protective_stop" else ""
        )
        if event or harm or fired < end:  # where one that was cut off would have led is not known
            out.steps.append((state, name, after, round(fired - since, 3), harm))
        state = after
        if harm in ("off the table", "tilt", "stop"):
            break
    out.ended = lockstep.now
    return out


def _send(arms: TwoArmService, node: str) -> None:
    """To another node, within no time."""
    for verb in ("pause", "jump", "resume"):
        reply = arms.prepare(verb, {"node": node})()
        if not reply.accepted:
            raise RuntimeError(f"{verb} {node}: {reply.reason}")
