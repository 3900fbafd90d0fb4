"""What the sensors of the planar world report of its true motion, and when it arrives."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from deploy.robot import MobileBase
from observer.bench.conditions import Conditions
from services.messages import Array, BaseCommand, Imu, Odometry

GRAVITY = 9.81
Report = Odometry | Imu | BaseCommand


@dataclass(frozen=True)
class Motion:
    """True motion step by step.

    Attributes:
        t: instants (n,) [s], equally spaced.
        moved: displacement in B from each instant to the next, (n, 3) [m, m, rad].
        velocity: V_OB_B (n, 3).
        rate: its derivative (n, 3).
        start: pose X_OB at ``t[0]`` (3).
    """

    t: Array
    moved: Array
    velocity: Array
    rate: Array
    start: Array

    def path(self, distance: float = 1.0, heading: float = 1.0) -> Array:
        """Poses (n, 3) with every step scaled: what wheels of the wrong size would count."""
        turn = heading * self.moved[:, 2]
        angle = np.concatenate([self.start[2:], self.start[2] + np.cumsum(turn[:-1])])
        middle = angle + 0.5 * turn
        c, s = np.cos(middle), np.sin(middle)
        x, y = distance * self.moved[:, 0], distance * self.moved[:, 1]
        steps = np.stack([c * x - s * y, s * x + c * y], axis=1)
        ways = np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:-1], axis=0)])
        return np.column_stack([self.start[:2] + ways, angle])


def reports(
    motion: Motion,
    pose: Array,
    sent: Array,
    told: MobileBase,
    truth: MobileBase,
    how: Conditions,
    rng: np.random.Generator,
) -> list[tuple[float, Report]]:
    """Every message of a run with its arrival [s], in order of arrival.

    Args:
        motion: the truth.
        pose: of the truth, X_OB (n, 3).
        sent: commands (m, 3), equally spaced over the run.
        told: the robot as described; its delays are true.
        truth: the robot as it is.
        how: gaps, slips, stamps, tilt.
        rng: draws biases and noise.
    """
    t = motion.t
    dt = t[1] - t[0]
    every = math.ceil(len(t) / len(sent))
    out: list[tuple[float, Report]] = [
        (t[k * every] + dt, BaseCommand(t=t[k * every], velocity=u)) for k, u in enumerate(sent)
    ]
    step = round(1.0 / truth.imu.rate / dt)
    gyro, accel = _inertial(motion, pose, truth, how, step, rng)
    for at, g, a in zip(t[::step].tolist(), gyro, accel, strict=True):
        if not how.imu_gap[0] <= at < how.imu_gap[1]:
            out.append((at + told.imu.delay, Imu(t=at, gyro=g, accel=a)))
    step = round(1.0 / truth.odometry.rate / dt)
    for at, z in zip(t[::step].tolist(), _wheels(motion, truth, how, step), strict=True):
        if not how.odometry_gap[0] <= at < how.odometry_gap[1]:
            out.append((at + told.odometry.delay, Odometry(t=at + how.stamp_error, pose=z)))
    out.sort(key=lambda a: a[0])
    return out


def _inertial(
    motion: Motion,
    pose: Array,
    truth: MobileBase,
    how: Conditions,
    step: int,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Gyro and specific force in the sensor's frame, (m, 3) each."""
    (vx, vy, w), (rx, ry) = motion.velocity[::step].T, truth.imu.position[:2]
    ax, ay, aw = motion.rate[::step].T
    c, s = np.cos(pose[::step, 2]), np.sin(pose[::step, 2])
    gx, gy = how.tilt
    force = np.stack(
        [
            ax - w * vy - aw * ry - w * w * rx - (c * gx + s * gy),
            ay + w * vx + aw * rx - w * w * ry - (-s * gx + c * gy),
            np.full_like(w, GRAVITY),
        ],
        axis=1,
    )
    turn = np.stack([np.zeros_like(w), np.zeros_like(w), w], axis=1)
    w_sd, a_sd = truth.imu.gyro_noise, truth.imu.accel_noise
    w_bias, a_bias = truth.imu.gyro_bias, truth.imu.accel_bias
    # the axes that a planar robot uses are drawn first: the others change nothing about them
    used = rng.standard_normal(3) * [w_bias, a_bias, a_bias]
    used = used + rng.standard_normal((len(w), 3)) * [w_sd, a_sd, a_sd]
    rest = rng.standard_normal(3) * [w_bias, w_bias, a_bias]
    rest = rest + rng.standard_normal((len(w), 3)) * [w_sd, w_sd, a_sd]
    into_I = Rotation.from_euler("xyz", truth.imu.rotation).as_matrix()  # of rows: v_B' R_BI
    gyro = turn @ into_I + np.column_stack([rest[:, :2], used[:, 0]])
    accel = force @ into_I + np.column_stack([used[:, 1:], rest[:, 2]])
    return gyro, accel


def _wheels(motion: Motion, truth: MobileBase, how: Conditions, step: int) -> Array:
    """Odometry poses (m, 3), rounded, heading wrapped."""
    counted = (motion.path(*truth.odometry.scale) + how.slipped(motion.t))[::step]
    q = np.array(truth.odometry.resolution)
    z = np.round(counted / q) * q
    z[:, 2] = (z[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
    return np.asarray(z)
