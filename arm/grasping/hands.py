"""The control basis of the grasp: its objectives, what is composed of them, how it is executed.

What is executed at once is derived by the algebra from the sequence (Platt et al., Eq 8 to 11)::

    comply / gm / reach = moment / force / reach
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from arm.control import Composable, chain, parallelised
from arm.control.objective import Objective, Rows
from arm.control.priority import damped_inverse, priorities
from arm.grasping.above import Above
from arm.grasping.inward import Inward
from arm.grasping.joints import Ends, Rest
from arm.grasping.level import Level
from arm.grasping.model import JOINTS
from arm.grasping.reach import Carry, Reach
from arm.grasping.scene import Scene
from arm.grasping.shape import Clearance, Flat, Preshape
from arm.grasping.yields import Yield

Array = NDArray[np.float64]

HARD = 50.0
"""Force from which a palm that presses gives way, at least [N], ..."""
PUSHED = 20.0
"""... and one that means to touch nothing."""
THROWS, THROWS_MOST = 3.0, 150.0
"""Share of what is above the limit with which a palm is taken back [1], and the most of it [N]."""
RELEASED = 0.15
"""A box on the table is not pressed on for this long after a palm was pushed too hard [s]."""
Composition = Literal["null_space", "sum"]


@dataclass
class Move:
    """What a node has the hands do at a tick.

    Attributes:
        controller: the refining controller; None has the joints stand still.
        below: served with the freedom it leaves, highest priority first.
        composition: of ``controller``: by null spaces, or the plain sum of outputs.
        presses: the reference forces act.
        carries: share of the load on the palms that is fed forward.
    """

    controller: Composable | None
    below: tuple[Objective, ...] = ()
    composition: Composition = "null_space"
    presses: bool = False
    carries: float = 0.0


class Hands:
    """Objectives and controllers of a robot's two palms.

    Attributes:
        gm: Φ_gm = Φ_f / Φ_reach.
        comply: Φ_comply = Φ_m / Φ_f / Φ_reach.
        parallel: all three at once, by the algebra.
        lifted: Φ_comply with the line carried up.

    Args:
        rest: posture of both arms, shape (14,) [rad].
        lower, upper: ends of the joints, shape (14,) [rad].
        pad: stiffness of the palms [N/m].
    """

    def __init__(self, rest: Array, lower: Array, upper: Array, pad: float) -> None:
        self.reach, self.force, self.moment = Reach(), Inward(pad), Flat()
        self.yields = Yield()
        self.above = Above()
        self.ends = Ends(lower, upper)
        self.carry, self.roll = Carry(), Level()
        self.clearance, self.preshape, self.posture = Clearance(), Preshape(), Rest(rest)
        self.gm = self.force.subject_to(self.reach).called("gm")
        self.comply = self.moment.subject_to(self.force).subject_to(self.reach).called("comply")
        self.parallel: Composable = parallelised([self.reach, self.gm, self.comply])
        self._released = 0.0
        self.lifted = self.moment.subject_to(self.force).subject_to(self.carry).called("lifted")

    def reset(self) -> None:
        """Press no more, hold nothing."""
        self.force.reset()
        self.roll.release()

    def execute(self, move: Move, scene: Scene, moving: Array) -> tuple[Array, Array]:
        """One tick of a move.

        Args:
            move: what to do.
            scene: of this tick.
            moving: joint rates measured, shape (14,) [rad/s].

        Returns:
            Joint rates (14,) [rad/s], and torques of forces on the world (14,) [N m].
        """
        if move.controller is None:
            return np.zeros(JOINTS), np.zeros(JOINTS)
        self.yields.limit = max(HARD, 1.5 * self.force.goal) if move.presses else PUSHED
        self.roll.carries = move.carries > 0.0
        seen: Any = scene  # what these objectives are told instead of one tip's kinematics
        away = self.yields.rows(seen, scene.dt)
        if away.activation > 0.0:  # who is thrown back already is not held up
            away = Rows(away.J, np.maximum(away.rate, away.J @ moving))
        first = [away, self.above.rows(seen, scene.dt), self.ends.rows(seen, scene.dt)]
        rows = [o.rows(seen, scene.dt) for o in move.controller.parts()]
        below = [o.rows(seen, scene.dt) for o in move.below]
        if move.composition == "sum":
            qd = plain_sum([*rows, *below])
        else:
            qd = priorities([*first, *rows, *below], JOINTS).qd
        return qd, self._torque(move, scene) + self._away(scene)

    def _away(self, scene: Scene) -> Array:
        """J^T of a force with which palms that are pressed too hard are taken back.

        Along their normal alone, where they are soft: off anything hard they would bounce.
        """
        tau = np.zeros(JOINTS)
        for i, yields in enumerate(scene.feel.yielding):
            if yields:
                pressed = float(scene.feel.pushed[i, 1])
                excess = max(abs(pressed) - self.yields.limit, 0.0)
                normal = scene.palms.R[i][:, 1] @ scene.palms.J[i][:3]
                tau += normal * math.copysign(min(THROWS * excess, THROWS_MOST), pressed)
        return tau

    def _torque(self, move: Move, scene: Scene) -> Array:
        """J^T of what the palms press with, and of what they carry."""
        tau = np.zeros(JOINTS)
        if any(scene.feel.yielding):
            self._released = RELEASED
        self._released -= scene.dt
        if scene.box is None or not move.presses:
            return tau
        if self._released > 0.0 and move.carries == 0.0:
            return tau  # the table keeps it; held on to, it would be carried off
        n = scene.box.across
        for i, inward in enumerate((-n, n)):
            J, R = scene.palms.J[i], scene.palms.R[i]
            tau += J[:3].T @ (inward * self.force.force[i])
            if move.carries > 0.0 and scene.feel.touches[i]:
                load = R @ scene.feel.load[i]
                tau -= move.carries * (J[:3].T @ load)
                tau -= move.carries * scene.feel.twist[i] * (J[3:].T @ R[:, 1])
        return tau


def plain_sum(rows: list[Rows]) -> Array:
    """What each objective asks for by itself, added up: nothing protects one from the others."""
    qd = np.zeros(JOINTS)
    for row in rows:
        if row.activation > 0.0:
            size = float(np.vdot(row.J, row.J))
            qd += row.activation * (damped_inverse(row.J, size)[0] @ row.rate)
    return qd


def written(controller: Composable) -> list[str]:
    """How a controller came about, line by line, as in Eq 8 to 11."""
    derive = getattr(controller, "derivation", None)
    return list(derive()) if derive is not None else [str(chain(controller.parts()))]
