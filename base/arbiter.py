"""Fuse what the behaviours want into one command that the drive can follow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from base.behaviour import Vote
from services.messages import Array


class Arbiter:
    """Weighted mean of the votes, under every bound, within velocity and acceleration limits.

    Where a limit bites, vx and vy are shortened together: the platform goes where it was to go,
    only slower. A bound that tightens at once is met as fast as the acceleration limit allows.

    Args:
        speed_limit: (3,) of vx, vy, yaw rate [m/s, m/s, rad/s].
        acceleration_limit: (3,) [m/s^2, m/s^2, rad/s^2].
        period: time between commands [s]; a late call is allowed no larger step than a timely one.
    """

    def __init__(
        self, speed_limit: Iterable[float], acceleration_limit: Iterable[float], period: float
    ) -> None:
        self._speed = np.array(list(speed_limit))
        self._acceleration = np.array(list(acceleration_limit))
        self._period = period
        self._newest: float | None = None
        self._chosen = np.zeros(3)

    @property
    def chosen(self) -> Array:
        """(3,) newest command V_OB_B [m/s, m/s, rad/s]."""
        return self._chosen.copy()

    def choose(self, now: float, votes: Mapping[str, Vote]) -> Array:
        """The command for robot time ``now`` [s]: (3,) V_OB_B; no votes at all mean zero."""
        wanted, total = np.zeros(3), 0.0
        bound = self._speed
        for vote in votes.values():
            if vote.weight > 0:
                wanted = wanted + vote.weight * vote.velocity
                total += vote.weight
            if vote.bound is not None:
                bound = np.minimum(bound, np.maximum(vote.bound, 0.0))
        if total > 0:
            wanted = wanted / total
        wanted = _fit(wanted, bound)

        elapsed = self._period if self._newest is None else now - self._newest
        elapsed = min(max(elapsed, 0.0), self._period)
        self._newest = now
        step = _fit(wanted - self._chosen, self._acceleration * elapsed)
        self._chosen = self._chosen + step
        return self._chosen.copy()


def _fit(value: Array, box: Array) -> Array:
    """Shorten x and y together, and the turn by itself, until each is within its bound."""
    size = np.abs(value)
    out = value.copy()
    scale = min([1.0] + [float(box[i] / size[i]) for i in (0, 1) if size[i] > box[i]])
    out[:2] = np.clip(scale * value[:2], -box[:2], box[:2])
    out[2] = min(max(value[2], -box[2]), box[2])
    return out
