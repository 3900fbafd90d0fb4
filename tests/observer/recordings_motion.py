"""A robot whose motion is a formula, and what sensors of any kind would write down of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from deploy.robot import MobileBase
from observer.recordings.assumptions import IMU, ODOMETRY, PLATFORM
from observer.recordings.recording import Recording, Samples
from services.messages import Array

BASE = MobileBase(platform=PLATFORM, odometry=ODOMETRY, imu=IMU)
GRID = 0.001


@dataclass(frozen=True)
class Course:
    """True motion on a grid of 1 ms: t (n,), pose (n, 3), yaw rate (n,), force in B (n, 3)."""

    t: Array
    pose: Array
    rate: Array
    force: Array

    def at(self, t: Array) -> Array:
        """Pose (m, 3) at ``t`` (m,) [s]."""
        return np.stack([np.interp(t, self.t, column) for column in self.pose.T], axis=1)


def course(
    seed: int,
    seconds: float,
    yaw: float = 0.3,
    speed: float = 0.4,
    sideways: float = 0.0,
    turning: float = 0.0,
    stops: tuple[tuple[float, float], ...] = (),
) -> Course:
    """A random smooth course.

    Args:
        seed: of it.
        seconds: its length [s].
        yaw: yaw rate, root mean square [rad/s].
        speed: mean speed ahead [m/s]; it varies by a third.
        sideways: speed sideways, root mean square [m/s].
        turning: mean yaw rate [rad/s].
        stops: (start, end) of stands [s]; it slows down for half a second before and after.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, GRID)

    def wander(size: float) -> Array:
        """A sum of sines between 0.05 and 1 Hz."""
        f = rng.uniform(0.05, 1.0, 12)
        parts = np.sin(2 * np.pi * f[:, None] * t + rng.uniform(0, 6.28, 12)[:, None])
        return size * parts.sum(axis=0) / np.sqrt(6.0)

    going = np.ones_like(t)
    for start, end in stops:
        going *= np.clip(np.maximum(start - t, t - end) / 0.5, 0.0, 1.0)
    w = going * (turning + wander(yaw))
    vx = going * (speed + wander(speed / 3.0 + 0.1 * (sideways > 0)))
    vy = going * wander(sideways)
    heading = cumulative_trapezoid(w, dx=GRID, initial=0.0) + 0.3
    c, s = np.cos(heading), np.sin(heading)
    velocity = np.stack([c * vx - s * vy, s * vx + c * vy], axis=1)
    place = cumulative_trapezoid(velocity, dx=GRID, axis=0, initial=0.0)
    a = np.gradient(velocity, GRID, axis=0)
    force = np.stack([c * a[:, 0] + s * a[:, 1], -s * a[:, 0] + c * a[:, 1], 9.81 + 0 * t], axis=1)
    return Course(t, np.column_stack([place, heading]), w, force)


def logged(
    true: Course,
    seed: int = 0,
    *,
    odometry_rate: float = 20.0,
    imu_rate: float = 100.0,
    delay: float = 0.0,
    drift: float = 0.0,
    jitter: float = 0.0,
    resolution: tuple[float, float, float] = (1e-3, 1e-3, np.radians(0.1)),
    scale: float = 1.0,
    bias: float = 1e-3,
    gyro_noise: float = 9e-4,
    accel_noise: float = 0.03,
) -> Recording:
    """What odometry and IMU write down of a course; heading wrapped, then made continuous.

    Args:
        true: the course.
        seed: of noise.
        odometry_rate: [Hz].
        imu_rate: [Hz].
        delay: odometry is stamped so much late [s] ...
        drift: ... and by so much more, later [s/s].
        jitter: of odometry's sampling, in its stamps too [s].
        resolution: of odometry; 0 does not round.
        scale: heading by odometry over true heading.
        bias: of the gyro [rad/s].
        gyro_noise: per reading [rad/s].
        accel_noise: per reading [m/s^2].
    """
    rng = np.random.default_rng(1000 + seed)
    end = true.t[-1] - 0.1
    at = np.arange(0.1, end, 1.0 / odometry_rate)
    at = at + rng.uniform(-jitter, jitter, len(at))
    pose = true.at(at)
    pose[:, 2] = pose[0, 2] + scale * (pose[:, 2] - pose[0, 2])
    for k, step in enumerate(resolution):
        if step:
            pose[:, k] = np.round(pose[:, k] / step) * step
    pose[:, 2] = np.unwrap((pose[:, 2] + np.pi) % (2 * np.pi) - np.pi)
    stamp = at + delay + drift * (at - at.mean())
    t = np.arange(0.1, end, 1.0 / imu_rate)
    values = np.zeros((len(t), 6))
    values[:, :3] = rng.normal(0.0, gyro_noise, (len(t), 3))
    values[:, 2] += np.interp(t, true.t, true.rate) + bias
    values[:, 3:] = np.stack([np.interp(t, true.t, f) for f in true.force.T], axis=1)
    values[:, 3:] += rng.normal(0.0, accel_noise, (len(t), 3))
    return Recording(
        name="course",
        base=BASE,
        odometry=Samples(stamp, np.maximum(stamp, at + 0.01), pose),
        imu=Samples(t, t + 0.005, values),
    )
