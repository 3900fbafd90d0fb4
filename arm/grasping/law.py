"""The torque law of the grasp: joint rates followed by damping, forces by J^T f.

tau = M Kv (x - qd) + h + friction + J^T f. There is no position loop: palms in contact give way,
and what they press with is what is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm.grasping.model import JOINTS, TwoArmModel
from arm.joint_limits import Ends

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gains:
    """Of the law."""

    velocity: float = 60.0
    """Kv [1/s]."""
    acceleration: tuple[float, ...] = (8.0, 8.0, 8.0, 8.0, 32.0, 32.0, 32.0)
    """Largest change of the joints' reference rates [rad/s^2], of an arm's seven: near a
    singularity of the wrist all would wait for its joints, which have little to move, ..."""
    yielding: float = 100.0
    """... and of one that gives way."""
    friction_width: float = 0.02
    """Speed over which the Coulomb feed-forward changes sign [rad/s], ..."""
    friction_width_touching: float = 0.1
    """... and in contact, where more of it would turn moments into a limit cycle [rad/s]."""
    friction: float = 0.8
    """Share of the described Coulomb friction that is fed forward; all of it would hunt [1]."""
    integral: float = 6.0
    """Rate at which the rates' error is learned as a torque, while nothing is touched [1/s]."""


class Law:
    """Joint torques that follow joint rates.

    Args:
        model: as believed.
        gains: see ``Gains``.
    """

    def __init__(self, model: TwoArmModel, gains: Gains | None = None) -> None:
        self.gains = gains or Gains()
        self._model = model
        arms = model.robot.arms
        self._coulomb = np.array(arms.coulomb_friction * 2)
        self._viscous = np.array(arms.viscous_friction * 2)
        self._acceleration = np.array(self.gains.acceleration * 2)
        self._limit = np.array(arms.torque_limit * 2)
        self._fastest = 0.8 * np.array(arms.velocity_limit * 2)
        self.reference = np.zeros(JOINTS)
        self._learned = np.zeros(JOINTS)

    def reset(self) -> None:
        """Forget the past."""
        self.reference = np.zeros(JOINTS)
        self._learned = np.zeros(JOINTS)

    def torque(
        self,
        dt: float,
        wanted: Array,
        qd: Array,
        extra: Array,
        free: bool,
        ends: Ends,
        hard: bool = False,
    ) -> Array:
        """Torques for this tick, within the limits, shape (14,) [N m].

        The model must have been placed at the measured joints.

        Args:
            dt: since the last call [s].
            wanted: joint rates asked for, shape (14,) [rad/s].
            qd: measured joint rates, shape (14,) [rad/s].
            extra: of forces on the world, J^T f, shape (14,) [N m].
            free: the palms touch nothing.
            ends: of the joints' ranges.
            hard: a palm is pressed harder than it should be: give way at once.
        """
        g = self.gains
        wanted = wanted / max(1.0, float(np.max(np.abs(wanted) / self._fastest)))
        change = wanted - self.reference
        limit = g.yielding if hard else self._acceleration
        step = change * min(1.0, dt / max(float(np.max(np.abs(change) / limit)), 1e-12))
        before, self.reference = self.reference, self.reference + step
        # not slowed down with the others: a joint brakes for the end of its range by itself
        kept = np.minimum(np.maximum(self.reference, ends.lowest), ends.highest)
        if (kept != self.reference).any():
            self.reference, step = kept, kept - before
        M, h = self._model.dynamics()
        error = self.reference - qd
        if free:
            self._learned += (g.integral * dt) * (M.diagonal() * g.velocity * error)
            np.clip(self._learned, -self._coulomb, self._coulomb, out=self._learned)
        tau = M @ (g.velocity * error + step / max(dt, 1e-6)) + h + extra + self._learned
        width = g.friction_width if free else g.friction_width_touching
        tau += g.friction * self._coulomb * np.tanh(self.reference / width)
        tau += self._viscous * self.reference + ends.push * self._limit
        return np.clip(tau, -self._limit, self._limit)
