"""What the nodes of a hand share: joint references, the squeeze, what the fingertips feel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arm.hand.carrier import Carrier
from arm.hand.feel import Feel
from arm.hand.grasp import Try
from arm.hand.law import Law
from arm.hand.model import FINGERS, JOINTS, Placed
from arm.hand.moving import MovingHandModel, seen_from, turned
from arm.hand.plan import THREE, Plan, gently
from arm.hand.reaching import Guess
from arm.hand.sliding import PERIOD
from arm.hand.squeeze import internal
from arm.model import Base
from deploy.task import BottleTask

Array = NDArray[np.float64]


@dataclass(slots=True)
class Scene:
    """One tick.

    Attributes:
        dt, t: since the last one, and time [s].
        at: the hand as it is.
        cells: of the tips, shape (3, 6) [N], [N m].
        struck: a switch in palm or links touches something.
        base: motion of the platform.
    """

    dt: float
    t: float
    at: Placed
    cells: Array
    struck: bool
    base: Base


STIFF = (40.0, 45.0)
"""Bandwidth of arm and fingers [rad/s]. On the bus a torque answers a state some ms old: with what
serves without delay (100, 120) the joints oscillate from 4 ms on, with this not at 8 ms."""


class Handling:
    """Mutable, handed from node to node.

    Args:
        robot: name of the robot's folder in deploy/robots.
        task: what to fetch.
        seed: of the reaches that are drawn.

    Attributes:
        model, law: of arm and hand.
        plan: how to grasp; each reach is a grasp of its own.
        reference, rate: of the driven joints, shape (11,) [rad], [rad/s].
        squeeze: force that holds the bottle [N]; 0: nothing is held.
        tries: reaches so far.
        off: for how long each tip has touched nothing, shape (3,) [s].
        load: weight that the tips carry, low-passed [N].
        offset: of the palm from the bottle's axis, in O, shape (2,) [m]; the tips' middle tells.
        stood: height of the palm while what is held stood on the table [m].
    """

    def __init__(self, robot: str, task: BottleTask, seed: int = 0) -> None:
        self.model = MovingHandModel(robot)
        self.law = Law(self.model)
        self.task = task
        self.plan: Plan = replace(gently(THREE, 0.0), tries=1, stiff=STIFF)
        self.plan = replace(self.plan, way=replace(self.plan.way, radius=task.radius))
        self.rng = np.random.default_rng(seed)
        self.carrier = Carrier(self.model)
        self.feel = Feel(self.model.robot.hand.tip_radius)
        self.reference = np.zeros(JOINTS)
        self.rate = np.zeros(JOINTS)
        self.squeeze = 0.0
        self.tries: list[Try] = []
        self.off = np.zeros(FINGERS)
        self.load = 0.0
        self.offset = np.zeros(2)
        self.stood = 0.0
        self._due = 0.0

    def hold(self, scene: Scene) -> None:
        """Remember how the bottle is held: contacts that oppose each other are around its axis."""
        _, p, _ = self.model.palm_at(self.reference)
        R_OB = turned(scene.base)
        self.offset = (R_OB @ (p - scene.at.x.mean(axis=0)))[:2]
        self.stood = float(p[2])

    def begin(self) -> None:
        """Forget what an earlier program tried."""
        self.tries = []

    def guess(self, base: Base) -> Guess:
        """Where the bottle is believed to stand, in B."""
        task = self.task
        point = seen_from(base, np.array([task.x, task.y, task.table + task.grasp]))
        return Guess(point, np.array([0.0, 0.0, 1.0]))

    def sense(self, scene: Scene, own: bool) -> None:
        """Take in the cells; ``own``: a grasp keeps this feel up to date itself."""
        if not own:
            self.feel.add(scene.cells)
        if scene.t + 1e-9 < self._due:
            return
        self._due = scene.t + PERIOD
        if not own:
            self.feel.update(self.model.tip_rotations())
        self.off = np.where(self.feel.touching, 0.0, self.off + PERIOD)
        self.load += 0.5 * (-float(self.feel.force[:, 2].sum()) - self.load)

    def stay(self) -> None:
        """Keep the references where they are."""
        self.rate = np.zeros(JOINTS)

    def take(self, at: Placed) -> None:
        """Start from where the joints are."""
        self.reference = at.q.copy()
        self.stay()

    def go(self, scene: Scene, velocity: Array) -> None:
        """References of the arm after the palm's way in O, ``velocity`` (3,) [m/s]."""
        fingers = self.reference[7:].copy()
        self.reference, self.rate = self.carrier.follow(
            scene.dt, scene.base, velocity, self.reference
        )
        self.reference[7:] = fingers

    def torque(self, at: Placed) -> Array:
        """That follows the references and squeezes, shape (11,) [N m]."""
        locked = np.zeros(JOINTS, dtype=bool)
        force = np.zeros((FINGERS, 3))
        bandwidth = np.repeat(self.plan.stiff, [7, 4])
        if self.squeeze > 0.0:
            force = self.squeeze * internal(at.x, self.plan.way.pair)
        return self.law.follow(at, self.reference, self.rate, locked, force, bandwidth)
