"""A history in front of a filter: every measurement is fused at the instant it was sampled.

A history of (measurement, belief after it) is kept in the order of sampling. A late measurement
goes to its place and everything after it is done again: the exact method (see Larsen et al., CDC
1998, for approximations). What the filter knows is therefore a function of the set of measurements
and commands, not of their arrival.

Where delays are long, replay is spread over ticks: at most a budget of measurements is done again
per tick. Meanwhile the belief served is the one from before the late measurement, kept up to date
with what is newer; when the replay has caught up, it takes over. Late measurements that arrive
during a replay which is already past them wait for its end, so that it always ends.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Sequence

import numpy as np

from observer.belief import IMU, NAMES, ODOMETRY, SPEED, Belief, Event
from observer.commands import CommandHistory
from observer.planar_ekf import PlanarEKF
from services.messages import Array


class DelayedEKF:
    """Filter with history.

    Use: `add` measurements, `command` the commands, `settle`, then read `belief` (after the newest
    measurement) or `extrapolate` to now.

    Args:
        ekf: fuses one measurement after another.
    """

    def __init__(self, ekf: PlanarEKF) -> None:
        self.ekf = ekf
        self.options, self.motion = ekf.options, ekf.motion
        self.refused: Counter[str] = Counter()
        self._events: list[Event] = []
        self._keys: list[tuple[float, int]] = []
        self._beliefs: list[Belief] = []
        """After each event; shorter than the events while there is something to do again."""
        self._served: Belief | None = None
        """What is believed meanwhile; None: the last of the beliefs."""
        self._ahead: list[Event] = []
        """Events that the belief served lacks; they are in the history, too."""
        self._waiting: dict[tuple[float, int], Event] = {}
        """Late events that a replay under way has already passed."""

    # -- input ------------------------------------------------------------------------------

    def add(self, sensor: int, t: float, z: Sequence[float] | Array, now: float) -> bool:
        """Take a measurement in; it is fused by the next `settle`.

        Args:
            sensor: ODOMETRY (z = x, y, heading), SPEED (z = vx, vy, w) or IMU (z = gyro z, accel x,
                accel y).
            t: instant at which it was sampled [s].
            z: values (3).
            now: the present [s].

        Returns:
            False if refused: counted in ``refused`` under the sensor's name and ``non-finite``,
            ``future``, ``before_start``, ``too_old`` or ``duplicate``.
        """
        name = NAMES[sensor]
        value = np.array(z, dtype=np.float64)
        if value.shape != (3,) or not all(map(math.isfinite, (t, *value.tolist()))):
            return self._refuse(name, "non-finite")
        if t > now + self.options.future:
            return self._refuse(name, "future")
        if not self._events or t - self._keys[-1][0] > self.options.gap:
            if sensor == IMU:
                return self._refuse(name, "before_start")
            self._begin(sensor, t, value)
            return True
        key = (t, sensor)
        i = bisect_left(self._keys, key)
        if key in self._waiting or (i < len(self._keys) and self._keys[i] == key):
            return self._refuse(name, "duplicate")
        if i == 0 or t < self._keys[-1][0] - self.options.history:
            return self._refuse(name, "too_old")
        event = Event(t, sensor, value)
        if self._served is not None and i < len(self._beliefs):
            self._waiting[key] = event
            return True
        self._insert(i, event)
        return True

    def _insert(self, i: int, event: Event) -> None:
        self._redo(i)
        if self._served is not None and i == len(self._events):
            self._ahead.append(event)
        self._events.insert(i, event)
        self._keys.insert(i, (event.t, event.sensor))

    def _redo(self, i: int) -> None:
        """Everything from the ``i``-th event on is to be fused again; serve the old meanwhile."""
        if self._served is None and len(self._beliefs) > i:
            self._served, self._ahead = self._beliefs[-1], self._events[len(self._beliefs) :]
        del self._beliefs[i:]

    def command(self, t: float, velocity: Sequence[float] | Array) -> bool:
        """Take a command in: ``velocity`` V_OB_B (3) acts on the drive from ``t`` [s] on.

        Returns:
            False if refused: counted as ``command:`` ``non-finite``, ``too_old`` or ``duplicate``.
        """
        vx, vy, w = (float(v) for v in velocity)
        if not all(map(math.isfinite, (t, vx, vy, w))):
            return self._refuse("command", "non-finite")
        if self._keys and t < self._keys[-1][0] - self.options.history:
            return self._refuse("command", "too_old")
        if not self.commands.insert(t, (vx, vy, w)):
            return self._refuse("command", "duplicate")
        self.commands.forget(t - self.options.gap - self.options.history - 1.0)
        # what was measured before t does not change; the first belief is where history begins
        self._redo(max(bisect_right(self._keys, (t, -1)), 1))
        return True

    def _begin(self, sensor: int, t: float, value: Array) -> None:
        """Start at a pose, or at zero where only wheel speeds are to be had; keep the biases."""
        pose = value if sensor == ODOMETRY else np.zeros(3)
        if self._events:
            self.settle()
            before = self.belief
            if sensor == SPEED:
                pose = before.x[:3].copy()
            belief = self.ekf.again(before, t, pose)
            if sensor == SPEED:  # nobody said where it went meanwhile
                far = (t - before.t) * np.array(self.options.speed)
                belief.P[:3, :3] += before.P[:3, :3] + np.diag(far**2)
        else:
            belief = self.ekf.first(t, pose)
        self._events = [Event(t, ODOMETRY, pose)]
        self._keys = [(t, ODOMETRY)]
        self._beliefs = [belief]
        self._served, self._ahead, self._waiting = None, [], {}
        if sensor == SPEED:
            self._insert(1, Event(t, SPEED, value))

    def _refuse(self, name: str, reason: str) -> bool:
        self.refused[f"{name}: {reason}"] += 1
        return False

    # -- output -----------------------------------------------------------------------------

    @property
    def commands(self) -> CommandHistory:
        """What the drive was told."""
        return self.ekf.commands

    @property
    def started(self) -> bool:
        """Whether a first odometry has come."""
        return bool(self._events)

    @property
    def belief(self) -> Belief:
        """After the newest measurement, as of the last `settle`."""
        return self._served if self._served is not None else self._beliefs[-1]

    def extrapolate(self, belief: Belief, t: float) -> tuple[Array, Array]:
        """State (14) and covariance (14, 14) at ``t`` >= belief.t, from commands alone."""
        return self.ekf.extrapolate(belief, t)

    def rejected(self) -> dict[str, int]:
        """Refused measurements since start, by ``sensor: reason``."""
        out = dict(self.refused)
        if self.started:
            belief = self.belief
            if belief.odometry_gated:
                out["odometry: gate"] = belief.odometry_gated
            if belief.imu_gated:
                out["imu: gate"] = belief.imu_gated
        return out

    @property
    def settled(self) -> bool:
        """Whether everything added is part of the belief, each at its instant."""
        return not self._waiting and len(self._beliefs) == len(self._events)

    def settle(self, budget: int | None = None) -> None:
        """Fuse what was added, each at its instant, and drop what is past the history.

        Args:
            budget: measurements to replay at most, beside those newer than the belief served,
                which are never left waiting; None: all.
        """
        if not self._events:
            return
        left = math.inf if budget is None or self._served is None else budget
        if self._waiting or len(self._events) - len(self._beliefs) > left:
            for event in self._ahead:
                assert self._served is not None
                self._served = self.ekf.fuse(self._served, event)
        self._ahead = []
        while left > 0 and not self.settled:
            if len(self._beliefs) == len(self._events):
                waiting, self._waiting = self._waiting, {}
                for key in sorted(waiting):
                    self._insert(bisect_left(self._keys, key), waiting[key])
            while left > 0 and len(self._beliefs) < len(self._events):
                event = self._events[len(self._beliefs)]
                self._beliefs.append(self.ekf.fuse(self._beliefs[-1], event))
                left -= 1
        if len(self._beliefs) == len(self._events):
            self._served = None
            if not self._waiting:
                self._forget()

    def _forget(self) -> None:
        limit = self._keys[-1][0] - self.options.history
        drop = bisect_left(self._keys, (limit, -1)) - 1
        if drop > 16:  # in bundles: deleting from the front of a list moves the rest
            del self._events[:drop], self._keys[:drop], self._beliefs[:drop]
            self.commands.forget(self._keys[0][0])
