"""One measurement after another: filterpy's extended Kalman filter for a planar platform.

`PlanarEKF.fuse` maps (belief, measurement) to the belief after it and depends on nothing else but
the commands: that is what lets a history be replayed exactly.

filterpy gives the algebra. Not used of it: ``predict_update`` (takes the Jacobian at the old state,
cannot wrap angles) and its linear ``predict_x``. The state is one-dimensional: filterpy's default
column would silently broadcast with a measurement of length 3.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from observer.belief import ODOMETRY, Belief, Event
from observer.commands import STILL, Command, CommandHistory
from observer.filter_options import ODOMETRY_UPDATES, FilterOptions
from observer.motion_model import SIZE, MotionModel
from observer.sensor_models import ImuModel, OdometryModel, pose_residual, truncated
from services.messages import Array


class PlanarEKF(ExtendedKalmanFilter):
    """Prediction, gate and update.

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
        self._odometry_R, self._imu_R = odometry.covariance(), imu.covariance()
        self._dt = 0.0

    def first(self, t: float, pose: Array) -> Belief:
        """Belief after a first odometry ``pose`` (3) sampled at ``t`` [s]."""
        x = np.zeros(SIZE)
        x[:3] = pose
        P = np.zeros((SIZE, SIZE))
        P[:3, :3] = self._odometry_R
        P[range(3, 6), range(3, 6)] = np.square(self.options.speed)
        P[range(6, 9), range(6, 9)] = np.square(self.motion.disturbance)
        P[range(9, 12), range(9, 12)] = self.bias_variance
        return Belief(t, x, P, pose)

    def again(self, before: Belief, t: float, pose: Array) -> Belief:
        """Belief after odometry that ends a long silence: as `first`, but biases are kept."""
        new = self.first(t, pose)
        new.x[9:] = before.x[9:]
        new.P[9:, 9:] = before.P[9:, 9:]
        gated = before.odometry_gated, before.imu_gated
        return replace(new, odometry_gated=gated[0], imu_gated=gated[1])

    def fuse(self, before: Belief, event: Event) -> Belief:
        """Belief after a measurement that was sampled at or after ``before.t``."""
        if event.sensor == ODOMETRY:
            return self._fuse_odometry(before, event)
        return self._fuse_imu(before, event)

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
                    self.P[i, i] += min(g * grow, math.inf if i < 2 else 2.0) ** 2
                    self.P[3 + i, 3 + i] += min(g * grow, 1.0) ** 2
            slip_until = event.t + opt.slip_report
        elif opt.odometry_update == "interval" and self._rounding_matters(P):
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

    def _rounding_matters(self, P: Array) -> bool:
        """Far above the resolution both updates agree, and filterpy's Joseph form is the safer."""
        return all(P[i, i] < (100.0 * q) ** 2 for i, q in enumerate(self.odometry.resolution))

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
