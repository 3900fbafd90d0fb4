"""Plays a world to an observer, tick by tick, and keeps what it says beside the truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from observer.bench.world import DT, World
from observer.observer import Observer
from services.messages import Array, BaseCommand, Estimate, Imu, Odometry


@dataclass(frozen=True)
class Tick:
    """What an observer is given at an instant.

    Attributes:
        index: of the instant in the world.
        now: the instant [s].
        odometry, imu, commands: what arrived since the tick before, in order of arrival.
    """

    index: int
    now: float
    odometry: list[Odometry]
    imu: list[Imu]
    commands: list[BaseCommand]


def ticks(world: World, step: int = 1) -> Iterator[Tick]:
    """The ticks of a world, every ``step`` milliseconds."""
    i, arrivals = 0, world.arrivals
    for k in range(0, len(world.t), step):
        tick = Tick(k, k * DT, [], [], [])
        while i < len(arrivals) and arrivals[i][0] <= tick.now + 1e-9:
            message = arrivals[i][1]
            if isinstance(message, Odometry):
                tick.odometry.append(message)
            elif isinstance(message, Imu):
                tick.imu.append(message)
            else:
                tick.commands.append(message)
            i += 1
        yield tick


@dataclass
class Run:
    """Every estimate of a run beside the truth at the same instants, (n, 3) each."""

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
        return Run(
            self.t[keep],
            self.pose[keep],
            self.velocity[keep],
            self.acceleration[keep],
            self.true_pose[keep],
            self.true_velocity[keep],
            self.true_acceleration[keep],
            [e for e, k in zip(self.estimates, keep, strict=True) if k],
            self.observer,
        )


def run(observer: Observer, world: World, step: int = 2) -> Run:
    """Step an observer through a world, every ``step`` milliseconds, and keep every estimate."""
    estimates, at = [], []
    for tick in ticks(world, step):
        estimates.append(observer.step(tick.now, tick.odometry, tick.imu, tick.commands))
        at.append(tick.index)
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


@dataclass(frozen=True)
class Track:
    """What the figures need of a run, on a grid of its own.

    Attributes:
        index: of each instant in the world, (n,).
        step: milliseconds from one instant to the next; 0 if it varies.
        pose: X_OB (n, 3).
        velocity: V_OB_O (n, 3).
        covariance: of the pose, as reported, (n, 3, 3).
        slip: whether slip was reported, (n,).
        odometry_nis: (n,), nan where no odometry arrived.
        imu_nis: (n,), nan where no reading of the IMU arrived.
        cost: of each step [s], (n,); nan without a clock.
    """

    index: np.ndarray[tuple[int], np.dtype[np.int64]]
    step: int
    pose: Array
    velocity: Array
    covariance: Array
    slip: np.ndarray[tuple[int], np.dtype[np.bool_]]
    odometry_nis: Array
    imu_nis: Array
    cost: Array


def track(observer: Observer, world: World, clock: Callable[[], float] | None = None) -> Track:
    """Step an observer through a world every millisecond.

    Args:
        observer: fresh.
        world: whose messages it gets.
        clock: [s]; the cost of every step is measured with it.
    """
    n = len(world.t)
    pose, velocity, covariance = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3, 3))
    slip = np.zeros(n, dtype=np.bool_)
    nis, cost = np.full((2, n), math.nan), np.full(n, math.nan)
    for k, tick in enumerate(ticks(world)):
        if clock is None:
            e = observer.step(tick.now, tick.odometry, tick.imu, tick.commands)
        else:
            before = clock()
            e = observer.step(tick.now, tick.odometry, tick.imu, tick.commands)
            cost[k] = clock() - before
        pose[k], velocity[k], covariance[k] = e.pose, e.velocity, e.covariance[:3, :3]
        slip[k] = "slip" in e.reason
        if tick.odometry:
            nis[0, k] = e.odometry_nis
        if tick.imu:
            nis[1, k] = e.imu_nis
    return Track(np.arange(n), 1, pose, velocity, covariance, slip, nis[0], nis[1], cost)
