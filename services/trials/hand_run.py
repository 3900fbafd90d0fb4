"""One trial of a grasp by touch: world and hand in one process, judged by the truth.

The hand has switches in palm and links, as the person has who stops a trial of the paper when the
palm hits the object; where it touches with its tips only its load cells say.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from arm.hand.grasp import Grasp
from arm.hand.model import HandModel
from arm.hand.plan import Plan
from arm.hand.reaching import Guess, look, opened, solve
from sim.effects import GRAVITY
from sim.hand_world import PLACE, TABLE, HandWorld, Setting

Array = NDArray[np.float64]

ROBOT = "platform_hand"
PERIOD = 0.002
"""Of the torques [s]."""
LONGEST = 60.0
"""[s]"""
DIRECTIONS = np.array(
    [[0, 0, -1], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=float
)
SLIP = 0.02
"""Of the object in the hand, that counts as dropped [m]."""


@dataclass(frozen=True)
class Start:
    """Which reaches are drawn, and how well the object's place is known.

    Attributes:
        tilt: angle between palm and axis, from, to [rad].
        guess: largest error of the point to grasp, along each horizontal axis [m].
    """

    tilt: tuple[float, float] = (0.0, 1.3)
    guess: float = 0.005


@dataclass
class Felt:
    """What happened while sliding, in the last try, at every torque period.

    Attributes:
        off: periods in which a tip touched nothing at all, of ``samples``.
        released: such that ended with a tip that touches nothing, be it for a step of the physics.
        force: squared error of the normal force, a row an update [N], of tips' means.
        normal: angles between believed and true normals [rad].
        peak: largest force on a tip in the whole trial [N], of means over ``PERIOD``: contacts are
            rigid here, and a tip let go of for a step of the physics gets its share in the next.
        knock: the same of palm and links.
    """

    off: int = 0
    released: int = 0
    samples: int = 0
    force: list[list[float]] = field(default_factory=list)
    normal: list[list[float]] = field(default_factory=list)
    peak: float = 0.0
    knock: float = 0.0


@dataclass
class Trial:
    """A trial that is over.

    Attributes:
        grasp: the hand's program, with what it knows.
        felt: what was true meanwhile.
        simulated: [s].
        shake: worst movement of the object in the hand by direction [m]; empty if not lifted.
        push: the same, by axis.
        lifted: how far the object came up [m].
        slip: movement in the hand during the lift [m].
        moved: of the object while the fingers slid [m].
        tilted: of the object, largest before the grip [rad].
        axis: of the object, when the fingers had converged.
    """

    grasp: Grasp
    felt: Felt
    simulated: float = 0.0
    shake: list[float] = field(default_factory=list)
    push: list[float] = field(default_factory=list)
    lifted: float = 0.0
    slip: float = 0.0
    moved: float = 0.0
    tilted: float = 0.0
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))


class HandTrial:
    """Runs a trial; see ``run_hand``."""

    def __init__(
        self,
        seed: int,
        setting: Setting,
        plan: Plan,
        start: Start,
        friction: tuple[float, float],
    ) -> None:
        rng = np.random.default_rng(seed)
        place, world, hand = rng.spawn(3)
        yaw = float(place.uniform(-np.pi, np.pi))
        self.world = HandWorld(ROBOT, replace(setting, yaw=yaw), world)
        model = HandModel(ROBOT)
        low, high = self.world.thing.grasp if self.world.thing else (0.12, 0.15)
        off = place.uniform(-start.guess, start.guess, 2)
        point = np.array([*(PLACE + off), TABLE[2] + place.uniform(low, high)])
        guess = Guess(point, np.array([0.0, 0.0, 1.0]))
        if self.world.thing is not None:
            way = replace(plan.way, radius=self.world.thing.radius)
            plan = replace(plan, way=way)
        self._place(model, plan, guess, start, place)
        self.grasp = Grasp(model, plan, guess, hand, friction)
        self.trial = Trial(self.grasp, Felt())
        self._tau = np.zeros(11)
        self._substeps = round(PERIOD / setting.step)
        self._contacts: dict[str, Array] = {}
        self._touched: set[str] | None = None
        self._foot = self.world.object()[1].copy()

    def _place(
        self, model: HandModel, plan: Plan, guess: Guess, start: Start, rng: np.random.Generator
    ) -> None:
        """Draw reaches until one is possible: within joints' limits, touching nothing."""
        for _ in range(200):
            low, high = start.tilt
            R, p = look(guess, *rng.uniform([low, -1.2, -np.pi], [high, 1.2, np.pi]))
            arm = solve(model, R, p, rng)
            if arm is None:
                continue
            self.world.put(opened(arm, plan.spread, model.robot.hand.open))
            if not self.world.colliding():
                return
        # nothing fits between hand and object: go on from the last, which will be said to fail

    def run(self) -> Trial:
        """All phases, then shake and push if it was lifted."""
        trial, grasp = self.trial, self.grasp
        while self.world.time < LONGEST and not grasp.outcome and grasp.phase != "hold":
            self._tick()
            if grasp.phase in ("tare", "close", "slide"):
                R, p = self.world.object()
                trial.moved = float(np.linalg.norm(p - self._foot))
                trial.tilted = max(trial.tilted, float(np.arccos(min(1.0, R[2, 2]))))
                trial.axis = R[:, 2].copy()
        if grasp.phase == "hold":
            self._after_lift()
        if not grasp.outcome:
            grasp.outcome = "held" if grasp.phase == "hold" else "took too long"
        trial.simulated = self.world.time
        return trial

    def _after_lift(self) -> None:
        trial, world = self.trial, self.world
        trial.lifted = float(world.object()[1][2] - self._foot[2])
        if self._in_hand(0.5) > SLIP or trial.lifted < 0.05:
            self.grasp.outcome = "the object slipped away"
            return
        for direction in DIRECTIONS:
            world.gravity_on_object = GRAVITY * direction
            trial.shake.append(self._in_hand(1.0))
        world.gravity_on_object = np.array([0.0, 0.0, -GRAVITY])
        for axis in np.eye(3):
            world.push = 20.0 * axis
            moved = self._in_hand(0.1)
            world.push = np.zeros(3)
            trial.push.append(max(moved, self._in_hand(0.5, moved=True)))

    def _in_hand(self, duration: float, moved: bool = False) -> float:
        """Run on; how far the object moved as the palm sees it, largest [m]."""
        if not moved:
            self._before = self._seen()
        worst, end = 0.0, self.world.time + duration
        while self.world.time < end - 1e-9:
            self._tick()
            worst = max(worst, float(np.linalg.norm(self._seen() - self._before)))
        return worst

    def _seen(self) -> Array:
        R, p = self.world.palm()
        middle = 0.5 * (self.world.thing.height if self.world.thing else 0.0)
        R_object, foot = self.world.object()
        return np.asarray(R.T @ (foot + middle * R_object[:, 2] - p))

    def _tick(self) -> None:
        world, grasp, felt = self.world, self.grasp, self.trial.felt
        contacts = self._contacts
        struck = any(not body.startswith("tip") for body in contacts)
        slid = grasp.slider
        updates = len(slid.history) if slid is not None else 0
        cells = world.cells(self._substeps)
        self._tau = grasp.step(world.time, world.q, world.qd, cells, struck)
        sliding = grasp.phase == "slide" and grasp.slider is slid and updates > 5
        new = grasp.slider is not None and len(grasp.slider.history) > updates
        if sliding:
            self._feel(contacts, new)
        if grasp.phase == "away":
            felt.off = felt.released = felt.samples = 0
            felt.force, felt.normal = [], []
        forces: dict[str, Array] = {}
        for _ in range(self._substeps):
            world.step(self._tau)
            self._contacts = world.contacts()
            for body, rows in self._contacts.items():
                forces[body] = forces.get(body, 0.0) + rows[:, 3:].sum(axis=0)
        self._touched = set(forces) if sliding else None
        for body, force in forces.items():
            size = float(np.linalg.norm(force)) / self._substeps
            if body.startswith("tip"):
                felt.peak = max(felt.peak, size)
            else:
                felt.knock = max(felt.knock, size)

    def _feel(self, contacts: dict[str, Array], new: bool) -> None:
        felt, feel = self.trial.felt, self.grasp.feel
        press = self.grasp.plan.press
        if new:
            felt.force.append([0.0] * 3)
            felt.normal.append([])
            measured = np.sum(-feel.force * feel.normals, axis=1)
            felt.force[-1] = (measured - press).tolist()
        middles = self.world.tips() if new else None
        for i, tip in enumerate(self.world.robot.hand.tips):
            rows = contacts.get(tip)
            if self._touched is not None:  # not known of the first period
                felt.samples += 1
                felt.off += tip not in self._touched
                felt.released += rows is None
            if rows is not None and middles is not None:
                n = rows[:, :3].mean(axis=0) - middles[i]
                n /= max(np.linalg.norm(n), 1e-9)
                cosine = float(np.clip(n @ feel.normals[i], -1.0, 1.0))
                felt.normal[-1].append(float(np.arccos(cosine)))


def run_hand(
    seed: int,
    setting: Setting,
    plan: Plan,
    start: Start | None = None,
    friction: tuple[float, float] = (0.0, 0.0),
) -> Trial:
    """A trial in one process.

    Args:
        seed: of everything drawn.
        setting: what is in the world.
        plan: how to grasp.
        start: which reaches are drawn.
        friction: share of described joint friction that the hand feeds forward, arm and hand.
    """
    return HandTrial(seed, setting, plan, start or Start(), friction).run()
