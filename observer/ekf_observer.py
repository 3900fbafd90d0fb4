"""The observer proper: delayed filter, prediction to now, smooth output, report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from deploy.robot import MobileBase
from observer.belief import IMU, ODOMETRY
from observer.motion_model import SIZE, Floats
from observer.observer_options import ObserverOptions, make_filter
from observer.output import SmoothOutput
from observer.report import NEVER, covariance_in_O, reasons, unknown
from services.messages import BaseCommand, Estimate, Imu, Odometry


def _velocity_in_O(x: Floats) -> tuple[float, float, float]:
    c, s = math.cos(x[2]), math.sin(x[2])
    return c * x[3] - s * x[4], s * x[3] + c * x[4], x[5]


class EkfObserver:
    """Delayed EKF with smooth output, behind the `Observer` protocol.

    Filter work is done only when data arrive; a plain tick is scalar arithmetic.

    Args:
        robot: what the robot is.
        options: what is assumed beyond that.
    """

    def __init__(self, robot: MobileBase, options: ObserverOptions | None = None) -> None:
        self.robot = robot
        self.options = options or ObserverOptions()
        self._delay = self.options.command_latency + robot.platform.command_delay
        self._backwards = 0
        self._reset()

    def _reset(self) -> None:
        self.filter = make_filter(self.robot, self.options)
        self.output = SmoothOutput(self.options.output)
        self._now: float | None = None
        self._tip: list[float] | None = None  # state at _now
        self._P_tip = np.zeros((SIZE, SIZE))
        self._P_time = 0.0
        self._covariance = unknown()
        self._sigma = (math.inf, math.inf)
        self._rejected: dict[str, int] = {}
        self._jumped = -math.inf
        self._newest = {"odometry": -NEVER, "imu": -NEVER, "command": -NEVER}

    def step(
        self,
        now: float,
        odometry: Sequence[Odometry] = (),
        imu: Sequence[Imu] = (),
        commands: Sequence[BaseCommand] = (),
    ) -> Estimate:
        """Take in what arrived since the last tick and estimate the platform at ``now``.

        Args:
            now: robot time [s]; a step back beyond the filter's history (a restarted robot) starts
                the observer afresh, a smaller one leaves the output where it is.
            odometry: arrived poses X_OB, any order.
            imu: arrived readings, any order.
            commands: arrived commands V_OB_B, any order.

        Returns:
            Estimate with ``t == now``.
        """
        if self._now is not None and now < self._now - self.options.filter.history:
            self._backwards += 1
            self._reset()
        fresh = self._take(now, odometry, imu, commands)
        if not self.filter.started:
            return self._nothing(now)
        dt = 0.0 if self._now is None else now - self._now
        if self._tip is None or dt > self.options.pause or self._lost():
            self._restart(now)
        elif dt > 0.0:
            before = _velocity_in_O(self._tip)
            tip = self._advance(self._tip, self._now or 0.0, now)
            after = _velocity_in_O(tip)
            self._tip = tip
            if fresh:
                self._correct(now)
            elif now - self._P_time >= self.options.covariance_period:
                self._carry(now)
            self.output.step(
                dt,
                (after[0] - before[0], after[1] - before[1], after[2] - before[2]),
                self._tip[:3],
                _velocity_in_O(self._tip) if fresh else after,
            )
            if fresh or self._P_time == now:
                self._update_covariance()
        elif fresh:
            self._correct(max(now, self._now or now))
            self._update_covariance()
        self._now = now if self._now is None else max(now, self._now)
        return self._report(now)

    # -- parts of a tick ----------------------------------------------------------------------

    def _take(
        self,
        now: float,
        odometry: Sequence[Odometry],
        imu: Sequence[Imu],
        commands: Sequence[BaseCommand],
    ) -> bool:
        """Pass messages to the filter; whether anything was measured (commands act alone)."""
        if not (odometry or imu or commands):
            return False
        f, newest, fresh = self.filter, self._newest, False
        for c in commands:
            if f.command(c.t + self._delay, c.velocity):
                newest["command"] = max(newest["command"], c.t)
        for o in odometry:
            if f.add(ODOMETRY, o.t, o.pose, now):
                newest["odometry"], fresh = max(newest["odometry"], o.t), True
        for m in imu:
            if f.add(IMU, m.t, (m.gyro[2], m.accel[0], m.accel[1]), now):
                newest["imu"], fresh = max(newest["imu"], m.t), True
        f.settle()
        self._rejected = f.rejected()
        if self._backwards:
            self._rejected["clock: backwards"] = self._backwards
        return fresh

    def _lost(self) -> bool:
        """Whether output and filter are too far apart to be brought together in motion."""
        ex, ey, ew = self.output.offset
        far = self.options.lost
        return math.hypot(ex, ey) > far[0] or abs(ew) > far[1]

    def _restart(self, now: float) -> None:
        """Put the output onto the filter; a jump that can be seen makes it invalid for a while."""
        first, old = self._tip is None, self.output.pose
        tip = self._correct(now)
        self.output.reset(tip[:3], _velocity_in_O(tip))
        self._update_covariance()
        if not first and math.dist(old, tip[:3]) > self.options.jump:
            self._jumped = now

    def _advance(self, x: list[float], start: float, end: float) -> list[float]:
        for duration, u in self.filter.commands.segments(start, end):
            x = self.filter.motion.advance(x, u, duration)
        return x

    def _correct(self, now: float) -> list[float]:
        """Replace the prediction by the newest belief, carried on to now."""
        belief = self.filter.belief
        x, self._P_tip = self.filter.extrapolate(belief, max(now, belief.t))
        tip: list[float] = x.tolist()
        self._tip, self._P_time = tip, now
        return tip

    def _carry(self, now: float) -> None:
        """Carry the covariance on without data, from where it was last."""
        at = replace(self.filter.belief, t=self._P_time, x=np.array(self._tip), P=self._P_tip)
        self._P_tip = self.filter.extrapolate(at, now)[1]
        self._P_time = now

    def _update_covariance(self) -> None:
        assert self._tip is not None
        self._covariance = covariance_in_O(
            self._tip,
            self._P_tip,
            self.filter.belief.repeats,
            self.robot.odometry.resolution,
            self.output.offset,
        )
        c = self._covariance
        self._sigma = (math.sqrt(max(c[0, 0], c[1, 1])), math.sqrt(c[2, 2]))

    def _report(self, now: float) -> Estimate:
        belief, tip, newest = self.filter.belief, self._tip, self._newest
        assert tip is not None
        (ax, ay, aw), _ = self.filter.motion.acceleration(tip, self.filter.commands.at(now))
        ax, ay = ax - tip[5] * tip[4], ay + tip[5] * tip[3]
        c, s = math.cos(tip[2]), math.sin(tip[2])
        odometry_age, imu_age = now - newest["odometry"], now - newest["imu"]
        command_age = now - newest["command"]
        valid, reason = reasons(
            self.options.limits,
            self._sigma,
            odometry_age,
            imu_age,
            slip=now < belief.slip_until,
            jumped=now - self._jumped < self.options.pause,
        )
        return Estimate(
            t=now,
            pose=np.array(self.output.pose),
            velocity=np.array(self.output.velocity),
            acceleration=np.array((c * ax - s * ay, s * ax + c * ay, aw)),
            covariance=self._covariance,
            gyro_bias=tip[9],
            accel_bias=np.array(tip[10:12]),
            odometry_innovation=belief.odometry_innovation,
            odometry_nis=min(belief.odometry_nis, NEVER),
            imu_innovation=belief.imu_innovation,
            imu_nis=min(belief.imu_nis, NEVER),
            odometry_age=max(odometry_age, 0.0),
            imu_age=min(max(imu_age, 0.0), NEVER),
            command_age=min(max(command_age, 0.0), NEVER),
            rejected=self._rejected,
            valid=valid,
            reason=reason,
        )

    def _nothing(self, now: float) -> Estimate:
        return Estimate(
            t=now,
            pose=np.zeros(3),
            velocity=np.zeros(3),
            acceleration=np.zeros(3),
            covariance=unknown(),
            gyro_bias=0.0,
            accel_bias=np.zeros(2),
            odometry_innovation=np.zeros(3),
            odometry_nis=0.0,
            imu_innovation=np.zeros(3),
            imu_nis=0.0,
            odometry_age=NEVER,
            imu_age=NEVER,
            command_age=min(now - self._newest["command"], NEVER),
            rejected=self._rejected,
            valid=False,
            reason="no odometry yet",
        )
