"""What the joints of any arm must not leave: their range, and their speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

JOINT_MARGIN = 0.02
"""Distance to the end of a joint's range that must be left [rad]."""
CLEAR = 0.06
"""What controllers keep clear of the end of a joint's range [rad], ..."""
BRAKING = 4.0
"""... braking for it like this [rad/s^2], ..."""
NEARING = 10.0
"""... and at last coming near it at this rate [1/s]."""
EXCUSED = 0.005
"""How much further a limit already left may be left on the way back [rad, m]."""
AVERAGED = 0.01
"""Encoder differences are noisy: a speed is judged over about this time [s]."""

PATIENCE = 0.1
"""A push may drive a joint faster than its limit for this long, where it may at all [s]."""


class Watched(Protocol):
    """Limits that are looked after."""

    @property
    def joint_margin(self) -> float:
        """Smallest distance of a joint to an end of its range [rad]."""
        ...

    def excuse(self) -> None:
        """What is still beyond its limit may come back."""
        ...


@dataclass(frozen=True)
class Ends:
    """What the ends of the joints' ranges ask of a controller.

    Attributes:
        lowest, highest: rates from which each joint can come to rest before its range ends,
            shape (n,) [rad/s]; beyond what is kept clear they lead back.
        push: share of each joint's torque that pushes back as an end stop would, shape (n,), from
            -1 to 1: 0 before what is kept clear, all of it at the very end.
    """

    lowest: Array
    highest: Array
    push: Array


class JointLimits:
    """Watches the joints of an arm, or of two.

    Args:
        names: of the n joints.
        lower, upper: ends of their ranges, shape (n,) [rad]; looked at, not copied.
        velocity: their limits, shape (n,) [rad/s].
        patience: how long a joint may be faster than its limit [s].

    Attributes:
        joint_margin: smallest distance of a joint to an end of its range [rad].
    """

    def __init__(
        self,
        names: Sequence[str],
        lower: Array,
        upper: Array,
        velocity: Sequence[float],
        patience: float = 0.0,
    ) -> None:
        self._names, self._lower, self._upper = names, lower, upper
        self._velocity = np.array(velocity)
        self._patience = patience
        self._speed = np.zeros(len(names))
        self._fast = 0.0
        self._floor = JOINT_MARGIN
        self.joint_margin = 0.0

    def excuse(self) -> None:
        """After a reset: a joint that is still too near its end may be brought back."""
        self._floor = -math.inf

    def ends(self, q: Array) -> Ends:
        """What the ends of the joints' ranges ask for at ``q``, shape (n,) [rad]."""
        down, up = q - self._lower - CLEAR, self._upper - CLEAR - q
        push = np.clip(-down / CLEAR, 0.0, 1.0) - np.clip(-up / CLEAR, 0.0, 1.0)
        return Ends(-_stoppable(down), _stoppable(up), push)

    def violated(self, dt: float, q: Array, qd: Array) -> str | None:
        """Name and figures of a limit that is left, or None.

        Args:
            dt: since the last call [s].
            q: measured joint positions, shape (n,) [rad].
            qd: measured joint velocities, shape (n,) [rad/s].
        """
        self._speed += (qd - self._speed) * min(dt / AVERAGED, 1.0)
        shares = list(map(abs, (self._speed / self._velocity).tolist()))
        self._fast = self._fast + dt if max(shares) > 1.0 else 0.0
        if self._fast > self._patience:
            i = shares.index(max(shares))
            return f"velocity limit of {self._names[i]}: {self._speed[i]:.2f} rad/s"
        left = (q - self._lower).tolist() + (self._upper - q).tolist()
        margin = self.joint_margin = float(min(left))
        if margin < self._floor:
            name = self._names[left.index(margin) % len(self._names)]
            return f"joint limit: {name} has {margin:.3f} rad left of {JOINT_MARGIN} rad"
        self._floor = min(max(self._floor, margin - EXCUSED), JOINT_MARGIN)
        return None


def _stoppable(left: Array) -> Array:
    """Fastest rates that still come to rest in what is left [rad]; negative beyond it [rad/s]."""
    near = NEARING * left
    return np.where(left > 0.0, np.minimum(near, np.sqrt(2.0 * BRAKING * np.abs(left))), near)
