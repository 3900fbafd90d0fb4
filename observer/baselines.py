"""What the observer is compared with, behind the same protocol."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from deploy.robot import MobileBase
from observer.report import NEVER, unknown
from observer.sensor_models import wrap
from services.messages import Array, BaseCommand, Estimate, Imu, Odometry, WheelSpeed


def _estimate(
    t: float, pose: Array, velocity: Array, acceleration: Array, covariance: Array, age: float
) -> Estimate:
    return Estimate(
        t=t,
        pose=pose,
        velocity=velocity,
        acceleration=acceleration,
        covariance=covariance,
        gyro_bias=0.0,
        accel_bias=np.zeros(2),
        odometry_innovation=np.zeros(3),
        odometry_nis=0.0,
        imu_innovation=np.zeros(3),
        imu_nis=0.0,
        odometry_age=min(max(age, 0.0), NEVER),
        imu_age=NEVER,
        command_age=NEVER,
        valid=age < NEVER,
        reason="" if age < NEVER else "no odometry yet",
    )


class Taylor:
    """Extrapolates the polynomial through the newest ``order + 1`` odometry poses to now.

    The paper's simple case. Order 0 holds the newest pose.

    Args:
        robot: for the resolution of the odometry.
        order: degree of the polynomial, 0 to 5.
        horizon: it is not followed further than this beyond the newest pose [s].

    Raises:
        ValueError: order out of range.
    """

    def __init__(self, robot: MobileBase, order: int = 1, horizon: float = 0.5) -> None:
        if not 0 <= order <= 5:
            raise ValueError(f"order {order} is not in 0..5")
        self.order, self.horizon = order, horizon
        self._samples: list[tuple[float, Array]] = []
        q = np.array(robot.odometry.resolution)
        # rounding alone; a floor, not a claim about the motion in between
        self._covariance = np.diag(
            np.concatenate([q**2 / 12.0, (q * robot.odometry.rate) ** 2 / 6.0])
        )

    def step(
        self,
        now: float,
        odometry: Sequence[Odometry] = (),
        imu: Sequence[Imu] = (),
        commands: Sequence[BaseCommand] = (),
        speeds: Sequence[WheelSpeed] = (),
    ) -> Estimate:
        """Estimate at ``now``; all but odometry poses is ignored."""
        for o in odometry:
            self._take(o)
        if not self._samples:
            zero = np.zeros(3)
            return _estimate(now, zero, zero, zero, unknown(), NEVER)
        newest = self._samples[-1][0]
        t = min(now, newest + self.horizon)
        pose, velocity, acceleration = self._polynomial(t)
        if t < now:
            velocity, acceleration = np.zeros(3), np.zeros(3)
        return _estimate(now, pose, velocity, acceleration, self._covariance, now - newest)

    def _take(self, o: Odometry) -> None:
        pose = np.array(o.pose, dtype=np.float64)
        if not (math.isfinite(o.t) and np.isfinite(pose).all()):
            return
        if self._samples:
            t, before = self._samples[-1]
            if o.t <= t:
                return
            pose[2] = before[2] + wrap(float(pose[2] - before[2]))
        self._samples = (
            [*self._samples[-self.order :], (o.t, pose)] if self.order else [(o.t, pose)]
        )

    def _polynomial(self, t: float) -> tuple[Array, Array, Array]:
        """Value and two derivatives at ``t`` by Newton's divided differences."""
        times = [s for s, _ in self._samples]
        table = [p.copy() for _, p in self._samples]
        n = len(times)
        for level in range(1, n):
            for i in range(n - 1, level - 1, -1):
                table[i] = (table[i] - table[i - 1]) / (times[i] - times[i - level])
        value, first, second = table[-1].copy(), np.zeros(3), np.zeros(3)
        for i in range(n - 2, -1, -1):
            d = t - times[i]
            second = second * d + 2.0 * first
            first = first * d + value
            value = value * d + table[i]
        return value, first, second


class Hold(Taylor):
    """The newest odometry pose, velocity zero: what using odometry as it comes amounts to."""

    def __init__(self, robot: MobileBase) -> None:
        super().__init__(robot, order=0)

    def step(
        self,
        now: float,
        odometry: Sequence[Odometry] = (),
        imu: Sequence[Imu] = (),
        commands: Sequence[BaseCommand] = (),
        speeds: Sequence[WheelSpeed] = (),
    ) -> Estimate:
        """Estimate at ``now``: the newest pose, however old."""
        return super().step(now, odometry)


class TruthReference:
    """Echoes ground truth: what a perfect observer would give. For reference only.

    Only a simulation can feed it, through `tell`; no robot has it.
    """

    def __init__(self) -> None:
        self._told: tuple[float, Array, Array, Array] | None = None

    def tell(self, t: float, pose: Array, velocity: Array, acceleration: Array) -> None:
        """Hand over truth at ``t`` [s]: X_OB, V_OB_O and A_OB_O, (3) each."""
        self._told = (
            t,
            np.array(pose, dtype=np.float64),
            np.array(velocity, dtype=np.float64),
            np.array(acceleration, dtype=np.float64),
        )

    def step(
        self,
        now: float,
        odometry: Sequence[Odometry] = (),
        imu: Sequence[Imu] = (),
        commands: Sequence[BaseCommand] = (),
        speeds: Sequence[WheelSpeed] = (),
    ) -> Estimate:
        """What was told, carried on to ``now`` with constant acceleration; inputs are ignored."""
        if self._told is None:
            zero = np.zeros(3)
            return _estimate(now, zero, zero, zero, unknown(), NEVER)
        t, pose, velocity, acceleration = self._told
        dt = now - t
        return _estimate(
            now,
            pose + dt * (velocity + 0.5 * dt * acceleration),
            velocity + dt * acceleration,
            acceleration,
            np.diag([1e-18] * 6),
            dt,
        )
