"""An extended Kalman filter that fuses every measurement at the instant it was sampled.

A history of (measurement, belief after it) is kept in the order of sampling. A late measurement
goes to its place and everything after it is done again: the exact method, affordable because delays
are short (see Larsen et al., CDC 1998, for approximations where they are not). What the filter
knows is therefore a function of the set of measurements and commands, not of their arrival.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Sequence

import numpy as np

from observer.belief import IMU, NAMES, ODOMETRY, Belief, Event
from observer.filter_options import FilterOptions
from observer.motion_model import MotionModel
from observer.planar_ekf import PlanarEKF
from observer.sensor_models import ImuModel, OdometryModel
from services.messages import Array


class DelayedEKF(PlanarEKF):
    """Filter with history.

    Use: `add` measurements, `command` the commands, `settle`, then read `belief` (after the newest
    measurement) or `extrapolate` to now.

    Arguments and errors are those of `PlanarEKF`.
    """

    def __init__(
        self,
        motion: MotionModel,
        odometry: OdometryModel,
        imu: ImuModel,
        gyro_bias: float,
        accel_bias: float,
        options: FilterOptions | None = None,
    ) -> None:
        super().__init__(motion, odometry, imu, gyro_bias, accel_bias, options)
        self.refused: Counter[str] = Counter()
        self._events: list[Event] = []
        self._keys: list[tuple[float, int]] = []
        self._beliefs: list[Belief] = []

    # -- input ------------------------------------------------------------------------------

    def add(self, sensor: int, t: float, z: Sequence[float] | Array, now: float) -> bool:
        """Take a measurement in; it is fused by the next `settle`.

        Args:
            sensor: ODOMETRY (z = x, y, heading) or IMU (z = gyro z, accel x, accel y).
            t: instant at which it was sampled [s].
            z: values (3).
            now: the present [s].

        Returns:
            False if refused: counted in ``refused`` under the sensor's name and ``non-finite``,
            ``future``, ``before_start``, ``too_old`` or ``duplicate``.
        """
        name = NAMES[sensor]
        value = np.array(z, dtype=np.float64)
        if not (math.isfinite(t) and value.shape == (3,) and np.isfinite(value).all()):
            return self._refuse(name, "non-finite")
        if t > now + self.options.future:
            return self._refuse(name, "future")
        if not self._events:
            if sensor == IMU:
                return self._refuse(name, "before_start")
            self._begin(self.first(t, value))
            return True
        if t - self._keys[-1][0] > self.options.gap:
            if sensor == IMU:
                return self._refuse(name, "before_start")
            self.settle()
            self._begin(self.again(self.belief, t, value))
            return True
        key = (t, sensor)
        i = bisect_left(self._keys, key)
        if i < len(self._keys) and self._keys[i] == key:
            return self._refuse(name, "duplicate")
        if i == 0 or t < self._keys[-1][0] - self.options.history:
            return self._refuse(name, "too_old")
        self._events.insert(i, Event(t, sensor, value))
        self._keys.insert(i, key)
        del self._beliefs[i:]
        return True

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
        i = bisect_right(self._keys, (t, -1))
        # what was measured before t does not change; the first belief is where history begins
        del self._beliefs[max(i, 1) :]
        return True

    def _begin(self, belief: Belief) -> None:
        self._events = [Event(belief.t, ODOMETRY, belief.odometry)]
        self._keys = [(belief.t, ODOMETRY)]
        self._beliefs = [belief]

    def _refuse(self, name: str, reason: str) -> bool:
        self.refused[f"{name}: {reason}"] += 1
        return False

    # -- output -----------------------------------------------------------------------------

    @property
    def started(self) -> bool:
        """Whether a first odometry has come."""
        return bool(self._events)

    @property
    def belief(self) -> Belief:
        """After the newest measurement, as of the last `settle`."""
        return self._beliefs[-1]

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

    def settle(self) -> None:
        """Fuse what was added, from the oldest addition on, and drop what is past the history."""
        if not self._events:
            return
        for event in self._events[len(self._beliefs) :]:
            self._beliefs.append(self.fuse(self._beliefs[-1], event))
        limit = self._keys[-1][0] - self.options.history
        drop = bisect_left(self._keys, (limit, -1)) - 1
        if drop > 16:  # in bundles: deleting from the front of a list moves the rest
            del self._events[:drop], self._keys[:drop], self._beliefs[:drop]
            self.commands.forget(self._keys[0][0])
