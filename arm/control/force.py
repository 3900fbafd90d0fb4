"""Force objective: an admittance along one direction, and the filter in front of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows, edge

if TYPE_CHECKING:
    from arm.model import Kinematics

Array = NDArray[np.float64]


class LowPass:
    """Two first-order low-pass filters in series.

    Args:
        cutoff: of each [Hz]; infinite passes everything.
    """

    def __init__(self, cutoff: float) -> None:
        self.cutoff = cutoff
        self._first: float | None = None
        self.value = 0.0

    def step(self, x: float, dt: float) -> float:
        """Filter one sample taken ``dt`` [s] after the last; starts at the first sample."""
        if self._first is None or math.isinf(self.cutoff):
            self._first = self.value = x
            return x
        keep = math.exp(-2.0 * math.pi * self.cutoff * dt)
        self._first = keep * self._first + (1.0 - keep) * x
        self.value = keep * self.value + (1.0 - keep) * self._first
        return self.value


class ContactObserver:
    """Estimates the force at a springy tool, and how fast the surface comes towards it.

    The force obeys F' = K (u + d): u is the speed with which the arm presses, d all it does not
    know of, the error of the platform's velocity above all. A second-order observer with both
    poles at one place follows F and d. Unlike a low-pass it adds no lag to what the arm does
    itself, and what it learns of d can be taken out before it has become an error of the force.

    Args:
        stiffness: K of the tool along the direction [N/m].
        cutoff: of both poles [Hz].
    """

    FASTEST = 40.0
    """Above this cut-off the poles would meet the arm's own dynamics [Hz]."""
    LOOSE = 0.1
    """Below this force there is no contact to learn from [N]."""
    MOST = 0.05
    """Largest d believed [m/s]."""

    def __init__(self, stiffness: float, cutoff: float) -> None:
        self.stiffness = stiffness
        self._pole = 2.0 * math.pi * min(cutoff, self.FASTEST)
        self.force = 0.0
        self.drift = 0.0

    def begin(self, force: float) -> None:
        """Start at a force [N], with nothing known of the surface."""
        self.force, self.drift = force, 0.0

    def step(self, measured: float, speed: float, dt: float) -> None:
        """Take in the force measured [N] after ``dt`` [s] of pressing with ``speed`` [m/s]."""
        K, keep = self.stiffness, math.exp(-self._pole * dt)
        force = self.force + K * (speed + self.drift) * dt
        innovation = measured - force
        # both poles of the discrete observer at exp(-pole dt)
        self.force = max(force + (1.0 - keep * keep) * innovation, 0.0)
        drift = self.drift + (1.0 - keep) ** 2 / (K * dt) * innovation
        self.drift = min(max(drift, -self.MOST), self.MOST) if self.force > self.LOOSE else 0.0


class Force(Objective):
    """Presses along a direction with a reference force: the tip moves at gain times the error.

    The direct way, a torque for the force, fails on a geared arm: its friction is worth many
    newtons at the tip. An admittance leaves friction to the position loop. With the tool's
    stiffness known it also takes out the speed at which the surface is found to come and go.

    Args:
        direction: unit vector in O along which the tool presses, shape (3,).
        gain: tip speed per newton of error [m/s/N].
        acceleration: largest change of the tip's speed [m/s^2].
        ramp: largest change of the reference force [N/s].
        observer: of the contact; None trusts the force measured as it comes.
    """

    name = "force"

    def __init__(
        self,
        direction: Array,
        gain: float,
        acceleration: float = 1.0,
        ramp: float = 4.0,
        observer: ContactObserver | None = None,
    ) -> None:
        self.direction = direction
        self.gain = gain
        self.acceleration = acceleration
        self.ramp = ramp
        self.observer = observer
        self.measured = 0.0
        self.reference = 0.0
        self._goal = 0.0
        self._speed = 0.0

    def begin(self, measured: float, speed: float) -> None:
        """Take over at the present force [N] and speed along the direction [m/s]."""
        self.measured = self.reference = measured
        self._speed = speed
        if self.observer is not None:
            self.observer.begin(measured)

    def press(self, goal: float, measured: float) -> None:
        """Set the force wanted and the force measured [N]; filtered, if there is no observer."""
        self._goal = goal
        self.measured = measured

    def error(self, kinematics: Kinematics) -> Array:
        """Reference less measured force, shape (1,) [N]."""
        felt = self.measured if self.observer is None else self.observer.force
        return np.array([self.reference - felt])

    def jacobian(self, kinematics: Kinematics) -> Array:
        """Of the tip's position along the direction."""
        return self.direction.dot(kinematics.J[:3])[None, :]

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Speed along the direction, with ramped reference and bounded acceleration.

        The platform's part is its steady velocity: what an observer bends its velocity by to
        bring the pose right would be felt as force.
        """
        step = self.ramp * dt
        self.reference += min(max(self._goal - self.reference, -step), step)
        if self.observer is None:
            wanted = self.gain * (self.reference - self.measured)
        else:
            self.observer.step(self.measured, self._speed, dt)
            wanted = self.gain * (self.reference - self.observer.force) - self.observer.drift
        change = self.acceleration * dt
        self._speed += min(max(wanted - self._speed, -change), change)
        drift = kinematics.drift if kinematics.steady is None else kinematics.steady
        rate = np.array([self._speed - float(self.direction.dot(drift[:3]))])
        return Rows(self.jacobian(kinematics), rate)


class Moment(Objective):
    """Turns the tool until the moment it feels about some axes is the reference.

    An admittance as ``Force`` is, and for the same reason. With a reference of zero a palm lays
    itself flat on what it presses (Φ_m of Platt et al., Eq 7).

    Args:
        axes: unit vectors in O about which the moment is controlled, shape (m, 3).
        gain: angular speed per newton metre of error [rad/s/(N m)].
        acceleration: largest change of the angular speed [rad/s^2].
        tolerance: radius of the goal region [N m]; 0 keeps the objective always active.
    """

    name = "moment"

    def __init__(
        self, axes: Array, gain: float, acceleration: float = 2.0, tolerance: float = 0.0
    ) -> None:
        self.axes = axes
        self.gain = gain
        self.acceleration = acceleration
        self.tolerance = tolerance
        self.reference = np.zeros(len(axes))
        self.measured = np.zeros(len(axes))
        self._rate = np.zeros(len(axes))

    def feel(self, moment: Array) -> None:
        """Set the (filtered) moment of the tool on the world about the tip, in O, (3,) [N m]."""
        self.measured = self.axes @ moment

    def error(self, kinematics: Kinematics) -> Array:
        """Reference less measured moment, shape (m,) [N m]."""
        return self.reference - self.measured

    def jacobian(self, kinematics: Kinematics) -> Array:
        """Of the tool's angular velocity about the axes."""
        return self.axes @ kinematics.J[3:]

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Angular speed about the axes, with bounded acceleration."""
        error = self.error(kinematics)
        change = self.acceleration * dt
        step = self.gain * error - self._rate
        self._rate = self._rate + np.minimum(np.maximum(step, -change), change)
        rate = self._rate - self.axes @ kinematics.drift[3:]
        return Rows(self.jacobian(kinematics), rate, edge(error, self.tolerance))
