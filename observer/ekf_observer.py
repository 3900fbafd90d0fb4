"""The observer proper: delayed filter, prediction to now, smooth output, report."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from deploy.robot import MobileBase
from observer.belief import IMU, ODOMETRY, SPEED
from observer.motion_model import SIZE, Floats
from observer.observer_options import ObserverOptions, make_filter
from observer.output import SmoothOutput
from observer.report import NEVER, covariance_in_O, reasons, unknown
from observer.sensor_models import reading_in_B, rotation_of
from observer.wheel_scale import WheelScale
from services.messages import Array, BaseCommand, Estimate, Imu, Odometry, WheelSpeed


def _velocity_in_O(x: Floats) -> tuple[float, float, float]:
    c, s = math.cos(x[2]), math.sin(x[2])
    return c * x[3] - s * x[4], s * x[3] + c * x[4], x[5]


def _age(age: float) -> float:
    """As reported: stamps may be a little ahead, and what never came is finitely old."""
    return 0.0 if age < 0.0 else age if age < NEVER else NEVER


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
        self._R_BI = rotation_of(robot.imu.rotation)
        self._smooth = self.options.output is not None
        self._reset()

    def _reset(self) -> None:
        self.filter = make_filter(self.robot, self.options)
        self.output = SmoothOutput(self.options.output)
        self._wheels = WheelScale(self.robot.odometry.scale)
        self._now: float | None = None
        self._tip: list[float] | None = None  # state at _now
        self._v_tip = (0.0, 0.0, 0.0)  # its velocity, in O
        self._P_tip = np.zeros((SIZE, SIZE))
        self._P_time, self._stale = 0.0, True
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
        speeds: Sequence[WheelSpeed] = (),
    ) -> Estimate:
        """Take in what arrived since the last tick and estimate the platform at ``now``.

        Args:
            now: robot time [s]; a step back beyond the filter's history (a restarted robot) starts
                the observer afresh, a smaller one leaves the output where it is.
            odometry: arrived poses X_OB, any order.
            imu: arrived readings, any order.
            commands: arrived commands V_OB_B, any order.
            speeds: arrived wheel speeds V_OB_B, any order; instead of or beside poses.

        Returns:
            Estimate with ``t == now``.
        """
        if self._now is not None and now < self._now - self.options.filter.history:
            self._backwards += 1
            self._reset()
        fresh = self._take(now, odometry, imu, commands, speeds)
        if not self.filter.started:
            return self._nothing(now)
        dt = 0.0 if self._now is None else now - self._now
        if self._tip is None or dt > self.options.pause or (fresh and self._lost()):
            self._restart(now)
        elif dt > 0.0:
            self._follow(self._now or 0.0, now, fresh)
        elif fresh:
            self._correct(self._now or now)
        self._now = now if self._now is None else max(now, self._now)
        return self._report(now)

    def _follow(self, before: float, now: float, fresh: bool) -> None:
        """Carry prediction and output on from the last tick; correct them if there is news."""
        assert self._tip is not None
        old = self._v_tip
        self._tip = self._advance(self._tip, before, now)
        new = target = _velocity_in_O(self._tip)
        if fresh:
            self._correct(now)
            target = self._v_tip
        self._v_tip = target
        if self._smooth:
            increment = (new[0] - old[0], new[1] - old[1], new[2] - old[2])
            self.output.step(now - before, increment, self._tip, target)
        else:
            self.output.reset(self._tip, target)
        # the covariance is brought up to date in a tick of its own, when there is one to spare
        since = now - self._P_time
        if (self._stale and not fresh) or since >= self.options.covariance_period:
            self._update_covariance(now)

    # -- parts of a tick ----------------------------------------------------------------------

    def _take(
        self,
        now: float,
        odometry: Sequence[Odometry],
        imu: Sequence[Imu],
        commands: Sequence[BaseCommand],
        speeds: Sequence[WheelSpeed],
    ) -> bool:
        """Pass messages to the filter; whether the belief has changed (commands act alone)."""
        f, newest, undelayed = self.filter, self._newest, self.options.undelayed
        if not (odometry or imu or commands or speeds):
            if not f.started or f.settled:
                return False
            f.settle(self.options.filter.replay)
            return f.settled
        fresh = False
        for c in commands:
            if f.command(c.t + self._delay, c.velocity):
                newest["command"] = max(newest["command"], c.t)
                f.commands.plan(c.t + self._delay, c.planned.tolist())
        for o in odometry:
            t = now if undelayed else o.t
            if f.add(ODOMETRY, t, self._wheels.correct(t, o.pose), now):
                newest["odometry"], fresh = max(newest["odometry"], o.t), True
        for s in speeds:
            t = now if undelayed else s.t
            if f.add(SPEED, t, self._scaled(s.velocity), now):
                newest["odometry"], fresh = max(newest["odometry"], s.t), True
        for m in imu:
            if f.add(
                IMU, now if undelayed else m.t, reading_in_B(self._R_BI, m.gyro, m.accel), now
            ):
                newest["imu"], fresh = max(newest["imu"], m.t), True
        f.settle(self.options.filter.replay)
        self._rejected = f.rejected()
        if self._backwards:
            self._rejected["clock: backwards"] = self._backwards
        return fresh

    def _scaled(self, velocity: Array) -> Array:
        distance, turn = self.robot.odometry.scale
        return velocity / (distance, distance, turn)

    def _lost(self) -> bool:
        """Whether output and filter are too far apart to be brought together in motion."""
        ex, ey, ew = self.output.offset
        far = self.options.lost
        return math.hypot(ex, ey) > far[0] or abs(ew) > far[1]

    def _restart(self, now: float) -> None:
        """Put the output onto the filter; a jump that can be seen makes it invalid for a while."""
        first, old = self._tip is None, self.output.pose
        self._correct(now)
        tip = self._tip
        assert tip is not None
        self.output.reset(tip, self._v_tip)
        self._update_covariance(now)
        if not first and math.dist(old, tip[:3]) > self.options.jump:
            self._jumped = now

    def _advance(self, x: list[float], start: float, end: float) -> list[float]:
        for duration, u in self.filter.commands.segments(start, end):
            x = self.filter.motion.advance(x, u, duration)
        return x

    def _correct(self, now: float) -> None:
        """Replace the prediction by the newest belief, carried on to now."""
        belief = self.filter.belief
        self._tip = self._advance(belief.x.tolist(), belief.t, now)
        self._v_tip = _velocity_in_O(self._tip)
        self._stale = True

    def _update_covariance(self, now: float) -> None:
        """What is known now: of a belief not yet accounted for, or without data as time passes."""
        assert self._tip is not None
        belief = self.filter.belief
        if not self._stale:
            belief = belief._replace(t=self._P_time, x=np.array(self._tip), P=self._P_tip)
        self._P_tip = self.filter.extrapolate(belief, max(now, belief.t))[1]
        self._P_time, self._stale = now, False
        self._covariance = covariance_in_O(
            self._tip,
            self._P_tip,
            belief.repeats,
            self.robot.odometry.resolution,
            self.output.offset,
            self.options.reported_floor,
        )
        c = self._covariance
        self._sigma = (math.sqrt(max(c[0, 0], c[1, 1])), math.sqrt(c[2, 2]))
        self.output.trust((math.sqrt(max(c[3, 3], c[4, 4])), math.sqrt(c[5, 5])))

    def _report(self, now: float) -> Estimate:
        belief, tip, newest = self.filter.belief, self._tip, self._newest
        assert tip is not None
        ax, ay, aw = self.filter.motion.acceleration(tip, self.filter.commands.at(now))
        ax, ay = ax - tip[5] * tip[4], ay + tip[5] * tip[3]
        c, s = math.cos(tip[2]), math.sin(tip[2])
        odometry_age, imu_age = now - newest["odometry"], now - newest["imu"]
        valid, reason = reasons(
            self.options.limits,
            self._sigma,
            odometry_age,
            imu_age,
            now < belief.slip_until,
            now - self._jumped < self.options.pause,
        )
        return Estimate(
            t=now,
            pose=np.array(self.output.pose),
            velocity=np.array(self.output.velocity),
            acceleration=np.array((c * ax - s * ay, s * ax + c * ay, aw)),
            covariance=self._covariance,
            gyro_bias=tip[9],
            accel_bias=belief.x[10:12],
            odometry_innovation=belief.odometry_innovation,
            odometry_nis=belief.odometry_nis,
            imu_innovation=belief.imu_innovation,
            imu_nis=belief.imu_nis,
            odometry_age=_age(odometry_age),
            imu_age=_age(imu_age),
            command_age=_age(now - newest["command"]),
            rejected=self._rejected,
            mode=belief.mode.mode.value,
            valid=valid,
            reason=reason,
            odometry_deviation=belief.odometry_deviation,
            imu_deviation=belief.imu_deviation,
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
            command_age=_age(now - self._newest["command"]),
            rejected=self._rejected,
            valid=False,
            reason="no odometry yet",
        )
