"""Fuse what the behaviours want into one command that the drive can follow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from base.behaviour import Vote
from base.fusion import RULES, collect, nearest
from base.jerk import JerkLimit
from services.messages import Array


class Arbiter:
    """One of the fusion rules, then the way there within acceleration and jerk limits.

    Those two hold for every command, whatever is voted. A bound or half-space that tightens at
    once is met as fast as they allow; who limits must look that far ahead.

    Args:
        speed_limit: (3,) of vx, vy, yaw rate [m/s, m/s, rad/s].
        acceleration_limit: (3,) [m/s^2, m/s^2, rad/s^2].
        period: time between commands [s]; a late call is allowed no larger step than a timely one.
        jerk_limit: (3,) [m/s^3, m/s^3, rad/s^3].
        rule: one of ``RULES``.

    Attributes:
        wanted: (3,) V_OB_B that the newest choice was on its way to.

    Raises:
        ValueError: no such rule; the text names all.
    """

    def __init__(
        self,
        speed_limit: Iterable[float],
        acceleration_limit: Iterable[float],
        period: float,
        jerk_limit: Iterable[float] = (8.0, 8.0, 16.0),
        rule: str = "optimum",
    ) -> None:
        if rule not in RULES:
            raise ValueError(f"no fusion rule {rule!r}. Rules: {', '.join(RULES)}")
        self._speed = np.array(list(speed_limit))
        self._limit = JerkLimit(self._speed, acceleration_limit, jerk_limit)
        self._rule = rule
        self._period = period
        self._newest: float | None = None
        self._jerk = np.array(list(jerk_limit))
        self._acceleration = np.array(list(acceleration_limit))
        self.wanted, self._drift = np.zeros(3), np.zeros(3)

    @property
    def chosen(self) -> Array:
        """(3,) newest command V_OB_B [m/s, m/s, rad/s]."""
        return self._limit.command.copy()

    def choose(self, now: float, votes: Mapping[str, Vote]) -> Array:
        """The command for robot time ``now`` [s]: (3,) V_OB_B; no votes at all mean zero."""
        before, self.wanted = self.wanted, self.fuse(votes)
        limits = collect(votes.values(), self._speed)[2]
        elapsed = self._period if self._newest is None else now - self._newest
        elapsed = min(elapsed, self._period)
        if elapsed <= 1e-6:
            return self.chosen
        self._newest = now
        command = self._limit.toward(self.wanted, elapsed, self._smooth(before, elapsed))
        if len(limits):
            command = self._within(command, limits, elapsed)
        self._limit.take(command, elapsed)
        return command

    def fuse(self, votes: Mapping[str, Vote]) -> Array:
        """(3,) V_OB_B that the votes come to under their limits, however it is got to."""
        return RULES[self._rule](*collect(votes.values(), self._speed))

    def plan(self, wishes: Iterable[Array]) -> Array:
        """(n, 3) the commands after the newest, if these (3,) are wanted one after the other."""
        limit, out, before = self._limit.copy(), [], self.wanted
        for wanted in wishes:
            drift = np.clip(
                (wanted - before) / self._period, -self._acceleration, self._acceleration
            )
            before = wanted
            command = limit.toward(np.clip(wanted, -self._speed, self._speed), self._period, drift)
            limit.take(command, self._period)
            out.append(command)
        return np.array(out).reshape(-1, 3)

    def _smooth(self, before: Array, elapsed: float) -> Array:
        """(3,) rate of what is wanted where it changes as a command may, else zero.

        A wish that moves smoothly is followed without lag; one that jumps is levelled off at.
        """
        drift = (self.wanted - before) / elapsed
        calm = np.abs(drift - self._drift) <= self._jerk * elapsed
        self._drift = drift
        return np.where(calm & (np.abs(drift) <= self._acceleration), drift, 0.0)

    def _within(self, command: Array, limits: Array, elapsed: float) -> Array:
        """The command, or one nearby that keeps the half-spaces, now and once it has levelled off.

        The rule of the weighted mean knows no way but to brake.
        """
        a, b = limits[:, :3], limits[:, 3]
        ahead = 1 + self._limit.levelling / elapsed
        # levelling off goes on from the newest command c: c + ahead * (u - c)
        level = np.column_stack([a * ahead, b + a @ ((ahead - 1) * self._limit.command)])
        rows = np.vstack([limits, level])
        if (rows[:, :3] @ command <= rows[:, 3] + 1e-9).all():
            return command
        if self._rule == "weighted":
            return self._limit.toward(np.zeros(3), elapsed)
        return nearest(command, *self._limit.reach(elapsed), rows)
