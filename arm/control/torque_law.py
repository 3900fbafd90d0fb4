"""The torque law: joint-space computed torque about a reference, with friction and contact.

Operational-space force control fails on a geared arm: the friction of joint 1 is worth 25 N at
the tip. So the reference moves (differential IK, an admittance along the board's normal) and the
joints follow it stiffly. The model is evaluated at the reference, which is free of noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm.model import ArmModel, Base, Inertia, Kinematics
from deploy.arms import Arm

Array = NDArray[np.float64]

INERTIA_TICKS = 5
"""The inertia is taken anew every so many ticks: at 1 rad/s it changes by 0.2 % in them."""
SAME = 1e-6
"""Ticks whose lengths differ by less are of one length [s]."""


@dataclass(frozen=True)
class Gains:
    """Of the torque law; docs/arm.md says how to choose them."""

    bandwidth: float = 50.0
    """Of the joint error, critically damped [rad/s]."""
    integral: float = 8.0
    """Rate of the integral action [1/s]."""
    velocity_filter: float = 80.0
    """Low-pass of the velocity error [Hz]."""
    acceleration_filter: float = 60.0
    """Low-pass of the reference's acceleration [Hz]."""
    friction_width: float = 0.001
    """Speed over which the Coulomb feed-forward changes sign [rad/s]."""
    friction_rate: float = 2.0
    """Adaptation of the Coulomb level [1/s]."""


class TorqueLaw:
    """Joint torques that follow a reference (q, qd) on a moving platform.

    Args:
        model: the arm as believed.
        gains: see ``Gains``.
    """

    def __init__(self, model: ArmModel, gains: Gains | None = None) -> None:
        self.gains = gains or Gains()
        self._model = model
        arm: Arm = model.robot.arm
        self._coulomb_nominal = np.array(arm.coulomb_friction)
        self._viscous = np.array(arm.viscous_friction)
        self.limit = np.array(arm.torque_limit)
        self._coulomb_least = 0.5 * self._coulomb_nominal
        self._coulomb_most = 1.5 * self._coulomb_nominal
        self.coulomb = self._coulomb_nominal.copy()
        self._tune(0.001)
        self.reset(np.zeros(model.joints))

    def reset(self, qd: Array) -> None:
        """Forget the past; the reference moves at ``qd``, shape (n,) [rad/s]."""
        self._inertia: Inertia | None = None
        self._inertia_age = 0
        self._integral = np.zeros(len(qd))
        self._qd_ref = qd.copy()
        self._acceleration = np.zeros(len(qd))  # of the reference, filtered
        self._velocity_error = np.zeros(len(qd))  # filtered
        self.saturated = False

    def torque(
        self,
        dt: float,
        q: Array,
        qd: Array,
        q_ref: Array,
        qd_ref: Array,
        base: Base,
        kinematics: Kinematics,
        contact: Array | None,
    ) -> Array:
        """Torques for this tick, within the limits, shape (n,) [N m].

        The model must have been placed at (base, q_ref, qd_ref) by the caller, which has
        ``kinematics`` from it.

        Args:
            dt: since the last call [s].
            q: measured joint positions, shape (n,) [rad].
            qd: measured joint velocities, shape (n,) [rad/s].
            q_ref: reference positions, shape (n,) [rad].
            qd_ref: reference velocities, shape (n,) [rad/s].
            base: motion of the platform.
            kinematics: of the tip at the reference.
            contact: force of the tool on the world in O, shape (3,) [N]; None if it touches
                nothing.
        """
        g = self.gains
        if abs(dt - self._dt) > SAME:  # differences of stamps carry rounding
            self._tune(dt)
        w = g.bandwidth
        acceleration, velocity_error = self._acceleration, self._velocity_error
        acceleration += ((qd_ref - self._qd_ref) / dt - acceleration) * self._blend_acceleration
        velocity_error += (qd_ref - qd - velocity_error) * self._blend_velocity
        self._qd_ref = qd_ref
        error = q_ref - q
        feedback = (2.0 * w) * velocity_error
        feedback += (w * w) * (error + self._integral)
        inertia = self._inertia_now()
        tau = self._model.torque(inertia, acceleration, feedback, base.acceleration)
        direction = np.tanh(qd_ref / g.friction_width)
        tau += self.coulomb * direction
        tau += self._viscous * qd_ref
        if contact is not None:
            tau += contact.dot(kinematics.J[:3])
        self.saturated = max(map(abs, (tau / self.limit).tolist())) > 1.0
        if self.saturated:
            return np.minimum(np.maximum(tau, -self.limit), self.limit)
        self._integral += error * (g.integral * dt)  # no wind-up against a limit
        self._adapt(dt, inertia.diagonal * feedback, direction)
        return tau

    def _inertia_now(self) -> Inertia:
        """Of the state last placed, or of one a few ticks ago."""
        self._inertia_age += 1
        if self._inertia is None or self._inertia_age >= INERTIA_TICKS:
            self._inertia = self._model.inertia()
            self._inertia_age = 0
        return self._inertia

    def _adapt(self, dt: float, step: Array, direction: Array) -> None:
        """Let the feedback that is still needed while moving raise or lower the Coulomb level.

        Args:
            dt: since the last call [s].
            step: that feedback, shape (n,) [N m]; overwritten.
            direction: in which the joints move, between -1 and 1, shape (n,).
        """
        step *= direction
        step *= np.abs(direction) > 0.9  # only while moving
        step *= self.gains.friction_rate * dt
        self.coulomb += step
        np.maximum(self.coulomb, self._coulomb_least, out=self.coulomb)
        np.minimum(self.coulomb, self._coulomb_most, out=self.coulomb)

    def _tune(self, dt: float) -> None:
        """Weights of the filters for ticks of ``dt`` [s]."""
        self._dt = dt
        g = self.gains
        self._blend_acceleration = blend(g.acceleration_filter, dt)
        self._blend_velocity = blend(g.velocity_filter, dt)


def blend(cutoff: float, dt: float) -> float:
    """Weight of a new sample in a first-order low-pass of ``cutoff`` [Hz] sampled every ``dt``."""
    return 1.0 - math.exp(-2.0 * math.pi * cutoff * dt)
