"""How a planar platform moves: first-order response to its command, plus a random disturbance.

State ``x`` (12), indices exported below::

    x, y, heading      X_OB, heading continuous           [m, m, rad]
    vx, vy, w          velocity of B in O, seen in B      [m/s, m/s, rad/s]
    dx, dy, dw         disturbance acceleration in B      [m/s^2, m/s^2, rad/s^2]
    bg                 gyro bias                          [rad/s]
    bax, bay           accelerometer biases               [m/s^2]

Per body axis, with command ``u``, lag ``tau`` and correlation time ``T``::

    v' = clip((u - v) / tau, +-limit) + d          d' = -d / T + noise

which is linear while ``u`` is constant, so velocity and displacement have a closed form. Only the
turn of the displacement into O is approximate: it uses the heading half-way (error of second order
in the angle turned per step, 1e-9 m at 1 rad/s, 0.3 m/s and 2 ms).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from services.messages import Array

SIZE = 12

Floats = Sequence[float]


@dataclass(frozen=True)
class MotionModel:
    """First-order drive with disturbance.

    Args:
        lag: time constant of the drive, tau [s].
        acceleration_limit: of the drive along vx, vy [m/s^2] and yaw [rad/s^2].
        disturbance: standard deviation of the disturbance acceleration, stationary
            [m/s^2, m/s^2, rad/s^2].
        correlation: its correlation time, T [s]; must differ from ``lag`` by 1 % at least.
        gyro_bias_walk: random walk of the gyro bias [rad/s per sqrt(s)].
        accel_bias_walk: random walk of the accelerometer biases [m/s^2 per sqrt(s)].

    Raises:
        ValueError: a time constant that is not positive, or ``correlation`` too close to ``lag``.
    """

    lag: float
    acceleration_limit: tuple[float, float, float]
    disturbance: tuple[float, float, float]
    correlation: float = 0.3
    gyro_bias_walk: float = 2e-5
    accel_bias_walk: float = 2e-4

    def __post_init__(self) -> None:
        if not (self.lag > 0 and self.correlation > 0):
            raise ValueError("lag and correlation must be positive [s]")
        if abs(self.lag - self.correlation) < 0.01 * self.lag:
            raise ValueError(
                f"correlation {self.correlation} s must differ from lag {self.lag} s by 1 % at"
                " least: the closed form divides by their difference"
            )

    def acceleration(self, x: Floats, u: Floats) -> tuple[list[float], list[float]]:
        """Derivative of the body velocity, and its slope in that velocity.

        Args:
            x: state (12).
            u: command V_OB_B (3) [m/s, m/s, rad/s].

        Returns:
            (3) derivative of (vx, vy, w) and (3) its partial derivatives in (vx, vy, w) [1/s];
            a slope is zero on an axis whose drive saturates.
        """
        rate, slope = [], []
        for i in range(3):
            wanted = (u[i] - x[3 + i]) / self.lag
            limit = self.acceleration_limit[i]
            if -limit <= wanted <= limit:
                rate.append(wanted + x[6 + i])
                slope.append(-1.0 / self.lag)
            else:
                rate.append(math.copysign(limit, wanted) + x[6 + i])
                slope.append(0.0)
        return rate, slope

    def _shift(self, x: Floats, u: Floats, dt: float) -> tuple[list[float], list[float], float]:
        """Velocity after ``dt``, displacement in B (3), and decay of the disturbance."""
        lag, corr = self.lag, self.correlation
        one_e = -math.expm1(-dt / lag)
        one_c = -math.expm1(-dt / corr)
        k = 1.0 / (1.0 / lag - 1.0 / corr)
        a1 = lag * one_e
        g0, g1 = k * (one_e - one_c), k * (corr * one_c - a1)
        velocity, moved = [], []
        for i in range(3):
            v, d, limit = x[3 + i], x[6 + i], self.acceleration_limit[i]
            gap = u[i] - v
            if -limit * lag <= gap <= limit * lag:
                velocity.append(v + gap * one_e + d * g0)
                moved.append(u[i] * dt - gap * a1 + d * g1)
            else:
                a, h0 = math.copysign(limit, gap), corr * one_c
                velocity.append(v + a * dt + d * h0)
                moved.append((v + 0.5 * a * dt) * dt + d * corr * (dt - h0))
        return velocity, moved, 1.0 - one_c

    def advance(self, x: Floats, u: Floats, dt: float) -> list[float]:
        """State after ``dt`` seconds of constant command.

        Args:
            x: state (12).
            u: command V_OB_B (3).
            dt: duration [s], not negative.

        Returns:
            State (12) as a list: scalar arithmetic is what makes a 500 Hz tick cheap.
        """
        velocity, (sx, sy, turn), decay = self._shift(x, u, dt)
        middle = x[2] + 0.5 * turn
        c, s = math.cos(middle), math.sin(middle)
        return [
            x[0] + c * sx - s * sy,
            x[1] + s * sx + c * sy,
            x[2] + turn,
            *velocity,
            x[6] * decay,
            x[7] * decay,
            x[8] * decay,
            x[9],
            x[10],
            x[11],
        ]

    def jacobian(self, x: Floats, u: Floats, dt: float) -> Array:
        """Derivative of `advance` in the state, (12, 12)."""
        lag, corr = self.lag, self.correlation
        one_e = -math.expm1(-dt / lag)
        one_c = -math.expm1(-dt / corr)
        k = 1.0 / (1.0 / lag - 1.0 / corr)
        a1, h0 = lag * one_e, corr * one_c
        free = (1.0 - one_e, a1, k * (one_e - one_c), k * (h0 - a1))
        saturated = (1.0, dt, h0, corr * (dt - h0))
        # per axis: v' by v, moved by v, v' by d, moved by d
        axes = [
            free if abs(u[i] - x[3 + i]) <= self.acceleration_limit[i] * lag else saturated
            for i in range(3)
        ]
        (exx, mxv, gx, mxd), (eyy, myv, gy, myd), (eww, mwv, gw, mwd) = axes
        _, (sx, sy, turn), decay = self._shift(x, u, dt)
        middle = x[2] + 0.5 * turn
        c, s = math.cos(middle), math.sin(middle)
        across, along = -(s * sx + c * sy), c * sx - s * sy  # d(x, y) by d(middle heading)
        f = np.eye(SIZE)
        f[0, 2:9] = across, c * mxv, -s * myv, 0.5 * across * mwv, c * mxd, -s * myd, 0.0
        f[1, 2:9] = along, s * mxv, c * myv, 0.5 * along * mwv, s * mxd, c * myd, 0.0
        f[0, 8], f[1, 8] = 0.5 * across * mwd, 0.5 * along * mwd
        f[2, 5], f[2, 8] = mwv, mwd
        f[3, 3], f[4, 4], f[5, 5] = exx, eyy, eww
        f[3, 6], f[4, 7], f[5, 8] = gx, gy, gw
        f[6, 6] = f[7, 7] = f[8, 8] = decay
        return f

    def process_noise(self, heading: float, dt: float, scale: float = 1.0) -> Array:
        """Covariance (12, 12) that the random disturbance adds in ``dt``.

        White noise of intensity ``2 sigma^2 / T`` integrated three times (to disturbance, velocity,
        displacement), to leading order in ``dt``: good to some per cent for steps up to 20 ms.

        Args:
            heading: by which displacement is turned into O [rad].
            dt: duration [s].
            scale: factor on the variance of the disturbance.
        """
        c, s = math.cos(heading), math.sin(heading)
        q = np.zeros((SIZE, SIZE))
        turn = ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))
        intensity = [2.0 * scale * sd * sd / self.correlation for sd in self.disturbance]
        pp, pv, vv = dt**5 / 20.0, dt**4 / 8.0, dt**3 / 3.0
        pd, vd, dd = dt**3 / 6.0, dt**2 / 2.0, dt
        rot = np.array(turn)
        along = rot * np.array(intensity)
        q[0:3, 0:3] = (along @ rot.T) * pp
        q[0:3, 3:6] = along * pv
        q[3:6, 0:3] = along.T * pv
        q[0:3, 6:9] = along * pd
        q[6:9, 0:3] = along.T * pd
        for i, n in enumerate(intensity):
            q[3 + i, 3 + i], q[6 + i, 6 + i] = n * vv, n * dd
            q[3 + i, 6 + i] = q[6 + i, 3 + i] = n * vd
        q[9, 9] = self.gyro_bias_walk**2 * dt
        q[10, 10] = q[11, 11] = self.accel_bias_walk**2 * dt
        return q
