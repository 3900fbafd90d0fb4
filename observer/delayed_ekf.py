"""An extended Kalman filter that fuses every measurement at the instant it was sampled.

A history of (measurement, belief after it) is kept in the order of sampling. A late measurement
goes to its place and everything after it is done again: the exact method, affordable because delays
are short (see Larsen et al., CDC 1998, for approximations where they are not). What the filter
knows is therefore a function of the set of measurements and commands, not of their arrival.

The algebra is filterpy's; predicting a non-linear state, angles, time, gate and history are ours.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from observer.belief import IMU, NAMES, ODOMETRY, Belief, Event
from observer.commands import STILL, Command, CommandHistory
from observer.motion_model import SIZE, MotionModel
from observer.sensor_models import ImuModel, OdometryModel, pose_residual, truncated
from services.messages import Array

ODOMETRY_UPDATES = ("interval", "gaussian")


@dataclass(frozen=True)
class FilterOptions:
    """Knobs of the filter; the defaults were chosen on many seeds, see docs/observer.md."""

    odometry_update: str = "interval"
    """``interval`` (the value was rounded) or ``gaussian`` (R = q^2/12)."""
    history: float = 0.5
    """Measurements this much older than the newest can still be fused [s]."""
    future: float = 0.001
    """A stamp this far ahead of now is refused [s]."""
    odometry_gate: float = 25.0
    """Largest NIS (3 degrees of freedom) of odometry that is believed."""
    imu_gate: float = 60.0
    """The same of the IMU, after the disturbance was raised: only nonsense fails."""
    alert_nis: float = 30.0
    """NIS of the IMU that means: something pushes."""
    alert_factor: float = 400.0
    """Factor on the variance of the disturbance from then on ..."""
    alert_time: float = 0.15
    """... for this long [s]."""
    growth: tuple[float, float, float] = (0.002, 0.002, 0.0035)
    """Added pose deviation at the first refused odometry [m, m, rad]; doubles at each one more."""
    growth_limit: int = 8
    """No more doublings than that: 0.5 m, 51 deg per refusal."""
    slip_report: float = 0.5
    """Slip is reported for this long after the last refused odometry [s]."""
    standing: bool = True
    """Recognise standstill, which friction makes exact on a wheeled platform."""
    standing_after: float = 0.3
    """Standing: told to stand and odometry unchanged for so long [s], and no alert; then ..."""
    standing_speed: tuple[float, float, float] = (0.001, 0.001, 0.0005)
    """... velocity is measured as zero with this deviation [m/s, m/s, rad/s] ..."""
    standing_factor: float = 0.01
    """... at each odometry, and the variance of the disturbance is multiplied by this."""
    max_step: float = 0.02
    """Longest single prediction [s]; longer ones are cut, which keeps the noise model true."""
    max_steps: int = 250
    """... into no more than this many."""
    speed: tuple[float, float, float] = (0.5, 0.5, 0.5)
    """Standard deviation of the velocity before the first measurement [m/s, m/s, rad/s]."""


class DelayedEKF(ExtendedKalmanFilter):
    """Filter with history.

    Use: `add` measurements, `command` the commands, `settle`, then read `belief` (after the newest
    measurement) or `extrapolate` to now.

    Args:
        motion: process model.
        odometry: model of the pose measurement.
        imu: model of the inertial measurement.
        gyro_bias: standard deviation of the unknown gyro bias [rad/s].
        accel_bias: standard deviation of the unknown accelerometer biases [m/s^2].
        options: knobs.

    Raises:
        ValueError: unknown ``odometry_update``; the valid names are listed.
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
        super().__init__(dim_x=SIZE, dim_z=3)
        self.options = options or FilterOptions()
        if self.options.odometry_update not in ODOMETRY_UPDATES:
            raise ValueError(
                f"unknown odometry_update {self.options.odometry_update!r}."
                f" Valid: {', '.join(ODOMETRY_UPDATES)}"
            )
        self.motion, self.odometry, self.imu = motion, odometry, imu
        self.bias_variance = (gyro_bias**2, accel_bias**2, accel_bias**2)
        self.commands = CommandHistory()
        self.refused: Counter[str] = Counter()
        self._odometry_R, self._imu_R = odometry.covariance(), imu.covariance()
        self._u: Command = (0.0, 0.0, 0.0)
        self._dt = 0.0
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
            self._start(t, value)
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
        i = bisect_right(self._keys, (t, -1))
        # what was measured before t does not change; the first belief is where history begins
        del self._beliefs[max(i, 1) :]
        return True

    def _refuse(self, name: str, reason: str) -> bool:
        self.refused[f"{name}: {reason}"] += 1
        return False

    def _start(self, t: float, pose: Array) -> None:
        x = np.zeros(SIZE)
        x[:3] = pose
        P = np.zeros((SIZE, SIZE))
        P[:3, :3] = self._odometry_R
        P[range(3, 6), range(3, 6)] = np.square(self.options.speed)
        P[range(6, 9), range(6, 9)] = np.square(self.motion.disturbance)
        P[range(9, 12), range(9, 12)] = self.bias_variance
        self._events = [Event(t, ODOMETRY, pose)]
        self._keys = [(t, ODOMETRY)]
        self._beliefs = [Belief(t, x, P, pose)]

    # -- output -----------------------------------------------------------------------------

    @property
    def started(self) -> bool:
        """Whether a first odometry has come."""
        return bool(self._events)

    @property
    def settled(self) -> bool:
        """Whether `belief` contains all that was added."""
        return len(self._beliefs) == len(self._events)

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
            fuse = self._fuse_odometry if event.sensor == ODOMETRY else self._fuse_imu
            self._beliefs.append(fuse(self._beliefs[-1], event))
        limit = self._keys[-1][0] - self.options.history
        drop = bisect_left(self._keys, (limit, -1)) - 1
        if drop > 16:  # in bundles: deleting from the front of a list moves the rest
            del self._events[:drop], self._keys[:drop], self._beliefs[:drop]
            self.commands.forget(self._keys[0][0])

    def extrapolate(self, belief: Belief, t: float) -> tuple[Array, Array]:
        """State (12) and covariance (12, 12) at ``t`` >= belief.t, from commands alone."""
        self.x, self.P = belief.x, belief.P
        self._predict_to(belief.t, t, belief)
        return self.x, self.P

    # -- one measurement --------------------------------------------------------------------

    def predict_x(self, u: Command = (0.0, 0.0, 0.0)) -> None:
        """Advance the state by the model (filterpy's own is linear)."""
        self.x = np.array(self.motion.advance(self.x.tolist(), u, self._dt))

    def _predict_to(self, start: float, end: float, before: Belief, factor: float = 1.0) -> None:
        for duration, u in self.commands.segments(start, end):
            n = min(max(1, math.ceil(duration / self.options.max_step)), self.options.max_steps)
            self._dt = duration / n
            for _ in range(n):
                scale = factor
                if start <= before.alert_until:
                    scale = max(scale, self.options.alert_factor)
                elif before.standing and factor == 1.0 and u == STILL:
                    scale = self.options.standing_factor
                x = self.x.tolist()
                self.F = self.motion.jacobian(x, u, self._dt)
                self.Q = self.motion.process_noise(x[2], self._dt, scale)
                self.predict(u)
                start += self._dt

    def _nis(self) -> float:
        return float(self.y @ self.SI @ self.y)

    def _fuse_imu(self, before: Belief, event: Event) -> Belief:
        opt = self.options
        u = self.commands.at(event.t)
        alert_until = before.alert_until
        # each refusal in a row quadruples the disturbance: a hard bump may be real
        factor = opt.alert_factor * 4.0 ** min(before.imu_refused, 6) if before.imu_refused else 1.0
        while True:
            self.x, self.P = before.x, before.P
            self._predict_to(before.t, event.t, before, factor)
            x, P = self.x, self.P
            self.update(
                event.z, self.imu.jacobian, self.imu.expect, R=self._imu_R, args=(u,), hx_args=(u,)
            )
            nis = self._nis()
            if nis <= opt.alert_nis or alert_until >= event.t or factor > 1.0:
                break
            alert_until, factor = event.t + opt.alert_time, opt.alert_factor
        refused = nis > opt.imu_gate
        if refused:
            self.x, self.P = x, P
        return replace(
            before,
            t=event.t,
            x=self.x,
            P=self.P,
            imu_innovation=self.y,
            imu_nis=nis,
            imu_refused=before.imu_refused + 1 if refused else 0,
            imu_gated=before.imu_gated + refused,
            alert_until=alert_until,
            standing=before.standing and alert_until < event.t,
        )

    def _fuse_odometry(self, before: Belief, event: Event) -> Belief:
        opt = self.options
        self.x, self.P = before.x, before.P
        self._predict_to(before.t, event.t, before)
        x, P = self.x, self.P
        self.update(
            event.z,
            self.odometry.jacobian,
            self.odometry.expect,
            R=self._odometry_R,
            residual=pose_residual,
        )
        innovation, nis = self.y, self._nis()
        refused = nis > opt.odometry_gate
        count = before.odometry_refused + 1 if refused else 0
        slip_until = before.slip_until
        if refused:
            self.x, self.P = x, P.copy()
            grow = 2.0 ** min(before.odometry_refused, opt.growth_limit)
            share = innovation**2 / np.diag(self.S)
            for i, g in enumerate(opt.growth):
                # axes that agree keep their certainty, unless only all together disagree
                if share[i] > 9.0 or share.max() <= 9.0:
                    self.P[i, i] += (g * grow) ** 2
                    self.P[3 + i, 3 + i] += (g * grow) ** 2
            slip_until = event.t + opt.slip_report
        elif opt.odometry_update == "interval":
            self.x, self.P = x, P
            self._fuse_intervals(event.z)
        same = event.z == before.odometry
        r = before.repeats
        repeats = (
            r[0] + 1 if same[0] else 0,
            r[1] + 1 if same[1] else 0,
            r[2] + 1 if same[2] else 0,
        )
        since = min(before.unchanged_since, event.t) if all(repeats) else event.t
        standing = opt.standing and not refused and self._stands(event.t, since, before)
        if standing:
            self._fuse_standstill()
        return replace(
            before,
            t=event.t,
            x=self.x,
            P=self.P,
            odometry=event.z,
            repeats=repeats,
            unchanged_since=since,
            standing=standing,
            odometry_innovation=innovation,
            odometry_nis=nis,
            odometry_refused=count,
            odometry_gated=before.odometry_gated + refused,
            slip_until=slip_until,
        )

    def _stands(self, t: float, unchanged_since: float, before: Belief) -> bool:
        wait = self.options.standing_after - 1e-9
        return (
            t - unchanged_since >= wait
            and t > before.alert_until
            and self.commands.still_since(t) >= wait
        )

    def _fuse_standstill(self) -> None:
        """Velocity measured as zero, one axis after the other."""
        for i, deviation in enumerate(self.options.standing_speed, start=3):
            gain = self.P[:, i]
            total = float(gain[i]) + deviation * deviation
            self.x = self.x - gain * (float(self.x[i]) / total)
            self.P = self.P - np.outer(gain, gain) / total

    def _fuse_intervals(self, z: Array) -> None:
        """Truncated-Gaussian moment matching, one axis after the other.

        Given that x_i + noise lies within q/2 of z_i, the moments of that sum are those of a
        truncated Gaussian, and the rest of the state follows by regression on it.
        """
        for i, (q, noise) in enumerate(
            zip(self.odometry.resolution, self.odometry.noise, strict=True)
        ):
            gain = self.P[:, i]
            mean = float(self.x[i])
            total = float(gain[i]) + noise * noise
            offset = float(pose_residual(z, self.x[:3])[i])
            moments = truncated(mean, total, mean + offset - 0.5 * q, mean + offset + 0.5 * q)
            if moments is None:
                variance = total + q * q / 12.0
                shift, shrink = offset / variance, 1.0 / variance
            else:
                shift = (moments[0] - mean) / total
                shrink = (total - moments[1]) / (total * total)
            self.x = self.x + gain * shift
            self.P = self.P - np.outer(gain, gain) * shrink
