"""What the sensors say of a state: odometry, and an inertial unit beside the axis of turning.

Odometry is the pose itself, rounded to its resolution ``q``: the true value lies in an interval of
width ``q``. A filter that wants a Gaussian takes ``R = q^2 / 12``; `truncated` gives the moments
that the interval itself leaves.

The inertial unit sits at ``p_BI = (rx, ry)`` in B with its axes along those of B. A planar platform
does not roll or pitch, so gravity is on the sensor's z alone and drops out of::

    gyro_z  = w + bg
    accel_x = vx' - w vy - w' ry - w^2 rx + bax + (R' g)_x
    accel_y = vy' + w vx + w' rx - w^2 ry + bay + (R' g)_y

(the turn of B, angular acceleration over the lever arm, centripetal term, bias, and what gravity
leaks where the floor is tilted: constant in O, R turns B into O. Only turning tells it from bias.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from observer.motion_model import SIZE, Floats, MotionModel
from services.messages import Array

_H_POSE = np.eye(3, SIZE)
_H_POSE.setflags(write=False)
_H_SPEED = np.eye(3, SIZE, 3)
_H_SPEED.setflags(write=False)
_H_IMU = np.zeros((3, SIZE))
_H_IMU[0, 5] = _H_IMU[0, 9] = _H_IMU[1, 10] = _H_IMU[2, 11] = 1.0
_H_IMU.setflags(write=False)


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi) [rad]."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def pose_residual(z: Array, expected: Array) -> Array:
    """Innovation (3) of a pose; the heading's is the short way round."""
    y = np.subtract(z, expected)
    y[2] = wrap(float(y[2]))
    return y


def rotation_of(rpy: tuple[float, float, float]) -> Array | None:
    """R_BI (3, 3) of roll, pitch, yaw [rad]; None if it turns nothing."""
    if not any(rpy):
        return None
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def reading_in_B(R_BI: Array | None, gyro: Array, accel: Array) -> tuple[float, float, float]:
    """What the filter takes of a reading: yaw rate and horizontal accelerometer, along axes of B.

    Args:
        R_BI: of `rotation_of`.
        gyro: as read, (3) [rad/s].
        accel: as read, (3) [m/s^2].
    """
    if R_BI is None:
        return gyro[2], accel[0], accel[1]
    accel = R_BI @ accel
    return float(R_BI[2] @ gyro), float(accel[0]), float(accel[1])


def truncated(mean: float, variance: float, low: float, high: float) -> tuple[float, float] | None:
    """Mean and variance of a Gaussian known to lie between ``low`` and ``high``.

    Returns:
        The two moments, or None where less than 1e-4 of the probability lies in the interval:
        there the tail decides and no moment can be trusted.
    """
    sd = math.sqrt(variance)
    a, b = (low - mean) / sd, (high - mean) / sd
    if a > 0:
        mass = 0.5 * (math.erfc(a * math.sqrt(0.5)) - math.erfc(b * math.sqrt(0.5)))
    else:
        mass = 0.5 * (math.erfc(-b * math.sqrt(0.5)) - math.erfc(-a * math.sqrt(0.5)))
    if mass < 1e-4:
        return None
    norm = 1.0 / (mass * math.sqrt(2.0 * math.pi))
    fa, fb = math.exp(-0.5 * a * a) * norm, math.exp(-0.5 * b * b) * norm
    shift = fa - fb
    return mean + sd * shift, variance * (1.0 + a * fa - b * fb - shift * shift)


@dataclass(frozen=True)
class OdometryModel:
    """Pose of B in O, rounded.

    Args:
        resolution: width of a step along x, y [m] and in heading [rad].
        noise: standard deviation before rounding: uneven wheels, stamps [m, m, rad].
    """

    resolution: tuple[float, float, float]
    noise: tuple[float, float, float]

    def covariance(self) -> Array:
        """Measurement noise (3, 3) with the rounding taken as Gaussian, R = q^2/12 + noise^2."""
        pairs = zip(self.resolution, self.noise, strict=True)
        return np.diag([q * q / 12.0 + n * n for q, n in pairs])

    def expect(self, x: Array) -> Array:
        """Measurement (3) expected in state (14)."""
        return x[:3]

    def jacobian(self, x: Array) -> Array:
        """Derivative of `expect`, (3, 14)."""
        return _H_POSE


@dataclass(frozen=True)
class ImuModel:
    """Gyro about z and accelerometer along x, y, at a lever arm.

    Args:
        motion: gives the acceleration of a state.
        position: p_BI along x and y of B [m].
        gyro_noise: standard deviation per sample [rad/s].
        accel_noise: standard deviation per sample [m/s^2].
    """

    motion: MotionModel
    position: tuple[float, float]
    gyro_noise: float
    accel_noise: float

    def covariance(self) -> Array:
        """Measurement noise (3, 3)."""
        return np.diag([self.gyro_noise**2, self.accel_noise**2, self.accel_noise**2])

    def expect(self, x: Floats, u: Floats) -> Array:
        """Measurement (gyro z, accel x, accel y) in state (14) under command (3)."""
        return self.expect_with_jacobian(x, u)[0]

    def jacobian(self, x: Floats, u: Floats) -> Array:
        """Derivative of `expect` in the state, (3, 14)."""
        return self.expect_with_jacobian(x, u)[1]

    def expect_with_jacobian(self, x: Floats, u: Floats) -> tuple[Array, Array]:
        """Measurement expected (3) and its derivative in the state (3, 14)."""
        ax, ay, aw = self.motion.acceleration(x, u)
        kx, ky, kw = self.motion.slopes(x, u)
        vx, vy, w, gx, gy = x[3], x[4], x[5], x[12], x[13]
        rx, ry = self.position
        c, s = math.cos(x[2]), math.sin(x[2])
        leak_x, leak_y = c * gx + s * gy, c * gy - s * gx
        expected = (
            w + x[9],
            ax - w * vy - aw * ry - w * w * rx + x[10] + leak_x,
            ay + w * vx + aw * rx - w * w * ry + x[11] + leak_y,
        )
        h = _H_IMU.copy()
        h[1:, 2:9] = (
            (leak_y, kx, -w, -vy - kw * ry - 2.0 * w * rx, 1.0, 0.0, -ry),
            (-leak_x, w, ky, vx + kw * rx - 2.0 * w * ry, 0.0, 1.0, rx),
        )
        h[1:, 12:] = ((c, s), (-s, c))
        return np.array(expected), h


@dataclass(frozen=True)
class SpeedModel:
    """Body velocity from the wheels, where the pose they add up to is not to be trusted.

    Args:
        noise: standard deviation of vx, vy [m/s] and w [rad/s].
    """

    noise: tuple[float, float, float]

    def covariance(self) -> Array:
        """Measurement noise (3, 3)."""
        return np.diag(np.square(self.noise))

    def expect(self, x: Array) -> Array:
        """Measurement (3) expected in state (14)."""
        return x[3:6]

    def jacobian(self, x: Array) -> Array:
        """Derivative of `expect`, (3, 14)."""
        return _H_SPEED
