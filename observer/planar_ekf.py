"""One measurement after another: filterpy's extended Kalman filter for a planar platform.

`PlanarEKF.fuse` maps (belief, measurement) to the belief after it and depends on nothing else but
the commands: that is what lets a history be replayed exactly.

filterpy gives the algebra. Not used of it: ``predict_update`` (takes the Jacobian at the old state,
cannot wrap angles) and its linear ``predict_x``. The state is one-dimensional: filterpy's default
column would silently broadcast with a measurement of length 3.
"""

from __future__ import annotations

import math

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from observer.belief import IMU, ODOMETRY, Belief, Event
from observer.commands import Command, CommandHistory
from observer.filter_options import MODES, ODOMETRY_UPDATES, FilterOptions
from observer.modes import Mode, ModeState
from observer.motion_model import SIZE, MotionModel
from observer.sensor_models import ImuModel, OdometryModel, SpeedModel, pose_residual, truncated
from observer.update import nis3, update3
from services.messages import Array

MOST = 1e6
"""Largest NIS that is told apart: beyond, all is nonsense, and the wire wants finite numbers."""


class PlanarEKF(ExtendedKalmanFilter):
    """Prediction, gate and update.

    Args:
        motion: process model.
        odometry: model of the pose measurement.
        speed: model of the wheel speeds.
        imu: model of the inertial measurement.
        gyro_bias: standard deviation of the unknown gyro bias [rad/s].
        accel_bias: standard deviation of the unknown accelerometer biases [m/s^2].
        options: knobs.

    Raises:
        ValueError: unknown ``odometry_update`` or ``modes``; the valid names are listed.
    """

    def __init__(
        self,
        motion: MotionModel,
        odometry: OdometryModel,
        speed: SpeedModel,
        imu: ImuModel,
        gyro_bias: float,
        accel_bias: float,
        options: FilterOptions | None = None,
    ) -> None:
        super().__init__(dim_x=SIZE, dim_z=3)
        self.options = options or FilterOptions()
        _check("odometry_update", self.options.odometry_update, ODOMETRY_UPDATES)
        _check("modes", self.options.modes, MODES)
        self.motion, self.odometry, self.speed, self.imu = motion, odometry, speed, imu
        self.bias_variance = (gyro_bias**2, accel_bias**2, accel_bias**2)
        self.commands = CommandHistory()
        self._odometry_R, self._imu_R = odometry.covariance(), imu.covariance()
        self._speed_R = speed.covariance()
        self._coarse = tuple((100.0 * q) ** 2 for q in odometry.resolution)
        self._switches = self.options.modes == "switch"
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
        P[12, 12] = P[13, 13] = self.options.floor_tilt**2
        return Belief(t, x, P, pose)

    def again(self, before: Belief, t: float, pose: Array) -> Belief:
        """Belief after odometry that ends a long silence: as `first`, but biases are kept."""
        new = self.first(t, pose)
        new.x[9:] = before.x[9:]
        new.P[9:, 9:] = before.P[9:, 9:]
        gated = before.odometry_gated, before.imu_gated
        return new._replace(odometry_gated=gated[0], imu_gated=gated[1])

    def fuse(self, before: Belief, event: Event) -> Belief:
        """Belief after a measurement that was sampled at or after ``before.t``."""
        if event.sensor == IMU:
            return self._fuse_imu(before, event)
        if event.sensor == ODOMETRY:
            return self._fuse_odometry(before, event)
        return self._fuse_speed(before, event)

    def extrapolate(self, belief: Belief, t: float) -> tuple[Array, Array]:
        """State (14) and covariance (14, 14) at ``t`` >= belief.t, from commands alone."""
        self.x, self.P = belief.x, belief.P
        self._predict_to(belief.t, t, belief)
        return self.x, self.P

    # -- one measurement --------------------------------------------------------------------

    def predict_x(self, u: Command = (0.0, 0.0, 0.0)) -> None:
        """Advance the state by the model (filterpy's own is linear); F at the old state."""
        x, self.F = self.motion.advance_with_jacobian(self.x.tolist(), u, self._dt)
        self.x = np.array(x)

    def _predict_to(
        self, start: float, end: float, before: Belief, factor: float | None = None
    ) -> None:
        """Carry x, P on; ``factor`` on the disturbance, by default that of the mode."""
        for duration, u in self.commands.segments(start, end):
            n = 1
            if duration > self.options.max_step:
                n = min(math.ceil(duration / self.options.max_step), self.options.max_steps)
            self._dt = duration / n
            for _ in range(n):
                scale = before.mode.scale(start, u, self.options) if factor is None else factor
                self.Q = self.motion.process_noise(float(self.x[2]), self._dt, scale)
                self.predict(u)
                start += self._dt

    def _nis(self) -> float:
        return min(nis3(self.S, self.y), MOST)

    def _fuse_imu(self, before: Belief, event: Event) -> Belief:
        opt = self.options
        u = self.commands.at(event.t)
        mode = before.mode
        factor = None
        if before.imu_refused:  # each refusal in a row quadruples it: a hard bump may be real
            factor = opt.alert_factor * 4.0 ** min(before.imu_refused, 6)
        while True:
            self.x, self.P = before.x, before.P
            self._predict_to(before.t, event.t, before, factor)
            expected, H = self.imu.expect_with_jacobian(self.x.tolist(), u)
            self.y = event.z - expected
            x, P, nis, self.S = update3(self.x, self.P, self.y, H, self._imu_R)
            if factor is not None or not self._switches or not mode.surprised(event.t, nis, opt):
                break
            mode, factor = mode.disturbed(event.t, opt), opt.alert_factor
        refused = nis > opt.imu_gate
        if refused:
            x, P = self.x, self.P
        return before._replace(
            t=event.t,
            x=x,
            P=P,
            imu_innovation=self.y,
            imu_nis=min(nis, MOST),
            imu_deviation=np.sqrt(self.S.diagonal()),
            imu_refused=before.imu_refused + 1 if refused else 0,
            imu_gated=before.imu_gated + refused,
            mode=mode,
        )

    def _fuse_speed(self, before: Belief, event: Event) -> Belief:
        self.x, self.P = before.x, before.P
        self._predict_to(before.t, event.t, before)
        x, P = self.x, self.P
        self.update(event.z, self.speed.jacobian, self.speed.expect, R=self._speed_R)
        nis = self._nis()
        refused = nis > self.options.odometry_gate
        slip_until = before.slip_until
        if refused:
            self.x, self.P = x, P
            slip_until = event.t + self.options.slip_report
        still = bool(np.abs(event.z).max() < 1e-9)
        since, mode = self._at_rest(before, event.t, still and not refused)
        return before._replace(
            t=event.t,
            x=self.x,
            P=self.P,
            unchanged_since=since,
            mode=mode,
            speed_nis=nis,
            odometry_gated=before.odometry_gated + refused,
            slip_until=slip_until,
        )

    def _fuse_odometry(self, before: Belief, event: Event) -> Belief:
        opt = self.options
        self.x, self.P = before.x, before.P
        self._predict_to(before.t, event.t, before)
        x, P = self.x, self.P
        interval = opt.odometry_update == "interval" and self._rounding_matters(P)
        if interval:  # needs of the Kalman update only what the gate asks for
            self.y = pose_residual(event.z, x[:3])
            self.S = P[:3, :3] + self._odometry_R
        else:
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
        elif interval:
            self._fuse_intervals(innovation)
        same = event.z == before.odometry
        r = before.repeats
        repeats = (
            r[0] + 1 if same[0] else 0,
            r[1] + 1 if same[1] else 0,
            r[2] + 1 if same[2] else 0,
        )
        since, mode = self._at_rest(before, event.t, all(repeats) and not refused)
        return before._replace(
            t=event.t,
            x=self.x,
            P=self.P,
            odometry=event.z,
            repeats=repeats,
            unchanged_since=since,
            mode=mode,
            odometry_innovation=innovation,
            odometry_nis=nis,
            odometry_deviation=np.sqrt(self.S.diagonal()),
            odometry_refused=count,
            odometry_gated=before.odometry_gated + refused,
            slip_until=slip_until,
        )

    def _rounding_matters(self, P: Array) -> bool:
        """Far above the resolution both updates agree, and filterpy's Joseph form is the safer."""
        a, b, c = self._coarse
        return bool(P[0, 0] < a and P[1, 1] < b and P[2, 2] < c)

    def _at_rest(self, before: Belief, t: float, still: bool) -> tuple[float, ModeState]:
        """Take in that the wheels were ``still``: since when they are, and the mode after it."""
        since = min(before.unchanged_since, t) if still else t
        mode = before.mode
        if self._switches:
            told = self.commands.still_since(t)
            mode = mode.after_odometry(t, min(t - since, told), self.options)
            if mode.mode is Mode.STANDING and still:
                self._fuse_standstill()
        return since, mode

    def _fuse_standstill(self) -> None:
        """Velocity measured as zero, one axis after the other."""
        for i, deviation in enumerate(self.options.standing_speed, start=3):
            gain = self.P[:, i]
            total = float(gain[i]) + deviation * deviation
            self.x = self.x - gain * (float(self.x[i]) / total)
            self.P = self.P - np.multiply.outer(gain, gain) / total

    def _fuse_intervals(self, innovation: Array) -> None:
        """Truncated-Gaussian moment matching, one axis after the other.

        Given that x_i + noise lies within q/2 of z_i, the moments of that sum are those of a
        truncated Gaussian, and the rest of the state follows by regression on it.
        """
        x, P, before = self.x, self.P, self.x
        for i, (q, noise) in enumerate(
            zip(self.odometry.resolution, self.odometry.noise, strict=True)
        ):
            gain = P[:, i]
            mean = float(x[i])
            total = float(gain[i]) + noise * noise
            offset = float(innovation[i] + before[i]) - mean
            moments = truncated(mean, total, mean + offset - 0.5 * q, mean + offset + 0.5 * q)
            if moments is None:
                variance = total + q * q / 12.0
                shift, shrink = offset / variance, 1.0 / variance
            else:
                shift = (moments[0] - mean) / total
                shrink = (total - moments[1]) / (total * total)
            x = x + gain * shift
            P = P - np.multiply.outer(gain, gain) * shrink
        self.x, self.P = x, 0.5 * (P + P.T)  # rounding would grow


def _check(option: str, value: str, valid: tuple[str, ...]) -> None:
    if value not in valid:
        raise ValueError(f"unknown {option} {value!r}. Valid: {', '.join(valid)}")
