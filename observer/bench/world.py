"""A small seeded planar world: true motion on a 1 ms grid and the messages it gives rise to.

Independent of observer/: the truth is integrated by plain small steps, so a fault in the closed
forms of the observer's model cannot hide here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from deploy.robot import Robot, load_robot
from observer.observer import Observer
from services.messages import Array, BaseCommand, Estimate, Imu, Odometry

DT = 0.001
ROBOT = load_robot("xr4000_puma560")


@dataclass
class World:
    """Truth and messages.

    Attributes:
        t: (n) [s].
        pose, velocity, acceleration: (n, 3) in O.
        arrivals: (arrival time [s], message), ordered.
    """

    t: Array
    pose: Array
    velocity: Array
    acceleration: Array
    arrivals: list[tuple[float, Odometry | Imu | BaseCommand]]


def sway(t: float) -> tuple[float, float, float]:
    """Command of the sway: y 0.3 m at 1 rad/s, x 0.1 m at 1.3 rad/s, yaw 5 deg at 0.8 rad/s."""
    heading = math.radians(5) * math.sin(0.8 * t)
    vx, vy = 0.13 * math.cos(1.3 * t), 0.3 * math.cos(t)
    c, s = math.cos(heading), math.sin(heading)
    return c * vx + s * vy, -s * vx + c * vy, math.radians(5) * 0.8 * math.cos(0.8 * t)


def drive(t: float) -> tuple[float, float, float]:
    """Ramps of 0.5 m/s^2 to 0.3 m/s along x, with stops, turning slowly."""
    phase = t % 4.0
    v = max(0.0, min(0.3, 0.5 * phase, 0.5 * (2.5 - phase)))
    return v, 0.0, 0.3 * v


def still(t: float) -> tuple[float, float, float]:
    """No command."""
    return 0.0, 0.0, 0.0


def simulate(
    command: Callable[[float], tuple[float, float, float]],
    seed: int,
    duration: float = 20.0,
    *,
    robot: Robot = ROBOT,
    odometry_rate: float = 20.0,
    disturbance: float = 1.0,
    noise: float | None = None,
    lag: float | None = None,
    pushes: tuple[float, ...] = (),
    slips: tuple[tuple[float, float, float, float], ...] = (),
    odometry_gap: tuple[float, float] = (1e9, 1e9),
    imu_gap: tuple[float, float] = (1e9, 1e9),
    stuck: bool = False,
    heading: float = 0.4,
) -> World:
    """Simulate a platform and its sensors.

    Args:
        command: V_OB_B by time, sent at 20 Hz and acting 1 ms later.
        seed: of everything random.
        duration: [s].
        robot: what the robot is said to be.
        odometry_rate: [Hz].
        disturbance: factor on 0.05 m/s^2, 0.1 rad/s^2 rms with 0.3 s correlation.
        noise: factor on the stated IMU noise; None draws 1 .. 1.5.
        lag: factor on the stated lag; None draws 0.9 .. 1.1.
        pushes: instants of a push of 200 N on 190 kg for 0.2 s, direction drawn.
        slips: (start, duration, dx, dy): odometry drifts by that much in O.
        odometry_gap: no odometry sampled in between [s].
        imu_gap: no IMU sampled in between [s].
        stuck: stiction holds the platform: truth is exactly constant.
        heading: true heading at start [rad].
    """
    rng = np.random.default_rng(seed)
    n = round(duration / DT) + 1
    tau = robot.platform.lag * (rng.uniform(0.9, 1.1) if lag is None else lag)
    factor = rng.uniform(1.0, 1.5) if noise is None else noise
    limit = np.array(robot.platform.acceleration_limit)
    deviation = np.array([0.05, 0.05, 0.1]) * disturbance
    keep = math.exp(-DT / 0.3)
    kicks = rng.standard_normal((n, 3)) * deviation * math.sqrt(1 - keep**2)
    d = rng.standard_normal(3) * deviation
    directions = rng.uniform(-math.pi, math.pi, len(pushes))

    pose, v, u = np.array([*rng.uniform(-1, 1, 2), heading]), np.zeros(3), np.zeros(3)
    poses, velocities, accelerations, specific = (np.empty((n, 3)) for _ in range(4))
    arrivals: list[tuple[float, Odometry | Imu | BaseCommand]] = []
    pending = np.zeros(3)
    rx, ry = robot.imu.position[:2]
    for k in range(n):
        t = k * DT
        if k % 50 == 1:
            u = pending
        if k % 50 == 0:
            pending = np.array(command(t))
            arrivals.append((t + 0.001, BaseCommand(t=t, velocity=pending)))
        push = np.zeros(3)
        for start, angle in zip(pushes, directions, strict=True):
            if start <= t < start + 0.2:
                push[:2] += 200.0 / 190.0 * np.array([math.cos(angle), math.sin(angle)])
        rate = np.clip((u - v) / tau, -limit, limit) + d + push
        if stuck:
            rate, v = np.zeros(3), np.zeros(3)
        w = v[2]
        ax, ay = rate[0] - w * v[1], rate[1] + w * v[0]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        poses[k] = pose
        velocities[k] = c * v[0] - s * v[1], s * v[0] + c * v[1], w
        accelerations[k] = c * ax - s * ay, s * ax + c * ay, rate[2]
        specific[k] = w, ax - rate[2] * ry - w * w * rx, ay + rate[2] * rx - w * w * ry
        after = v + rate * DT
        mean = 0.5 * (v + after)
        middle = pose[2] + 0.5 * DT * mean[2]
        c, s = math.cos(middle), math.sin(middle)
        pose = pose + DT * np.array([c * mean[0] - s * mean[1], s * mean[0] + c * mean[1], mean[2]])
        v, d = after, keep * d + kicks[k]

    bias = rng.standard_normal(3) * [robot.imu.gyro_bias, *2 * [robot.imu.accel_bias]]
    sd = np.array([robot.imu.gyro_noise, *2 * [robot.imu.accel_noise]]) * factor
    for k in range(0, n, 10):
        reading = specific[k] + bias + sd * rng.standard_normal(3)
        if not imu_gap[0] <= k * DT < imu_gap[1]:
            gyro, accel = np.array([0, 0, reading[0]]), np.array([*reading[1:], 9.81])
            arrivals.append((k * DT + robot.imu.delay, Imu(t=k * DT, gyro=gyro, accel=accel)))
    q = np.array(robot.odometry.resolution)
    for k in range(0, n, round(1.0 / odometry_rate / DT)):
        t = k * DT
        moved = poses[k].copy()
        for start, length, dx, dy in slips:
            moved[:2] += np.array([dx, dy]) * min(max((t - start) / length, 0.0), 1.0)
        z = np.round(moved / q) * q
        z[2] = (z[2] + math.pi) % (2 * math.pi) - math.pi
        if not odometry_gap[0] <= t < odometry_gap[1]:
            arrivals.append((t + robot.odometry.delay, Odometry(t=t, pose=z)))
    arrivals.sort(key=lambda a: a[0])
    return World(np.arange(n) * DT, poses, velocities, accelerations, arrivals)


@dataclass
class Run:
    """Estimates of a run beside the truth at the same instants, (n, 3) each."""

    t: Array
    pose: Array
    velocity: Array
    acceleration: Array
    true_pose: Array
    true_velocity: Array
    true_acceleration: Array
    estimates: list[Estimate]
    observer: Observer

    def after(self, start: float, end: float = math.inf) -> Run:
        """The part from ``start`` to ``end`` [s]."""
        keep = (self.t >= start) & (self.t < end)
        estimates = [e for e, k in zip(self.estimates, keep, strict=True) if k]
        arrays = (self.t, self.pose, self.velocity, self.acceleration)
        truths = (self.true_pose, self.true_velocity, self.true_acceleration)
        return Run(*(a[keep] for a in arrays), *(a[keep] for a in truths), estimates, self.observer)


def run(observer: Observer, world: World, step: int = 2) -> Run:
    """Step an observer through a world, every ``step`` milliseconds."""
    estimates, i = [], 0
    index = range(0, len(world.t), step)
    for k in index:
        now = k * DT
        batch: dict[type, list] = {Odometry: [], Imu: [], BaseCommand: []}
        while i < len(world.arrivals) and world.arrivals[i][0] <= now + 1e-9:
            message = world.arrivals[i][1]
            batch[type(message)].append(message)
            i += 1
        estimates.append(observer.step(now, batch[Odometry], batch[Imu], batch[BaseCommand]))
    at = np.array(index)
    return Run(
        world.t[at],
        np.array([e.pose for e in estimates]),
        np.array([e.velocity for e in estimates]),
        np.array([e.acceleration for e in estimates]),
        world.pose[at],
        world.velocity[at],
        world.acceleration[at],
        estimates,
        observer,
    )
