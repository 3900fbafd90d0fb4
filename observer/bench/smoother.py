"""What can be known of an instant half a second later: a fixed-lag smoother.

Rauch, Tung and Striebel's backward pass over the steps of the exact filter, ended ``lag`` after
each instant (Rauch et al. 1965; extended as the filter is, about the filtered state). No observer
that has to answer at once can reach it; it says how much the wait would be worth.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from observer.belief import IMU, ODOMETRY, Belief
from observer.bench.exact import exact_options
from observer.bench.play import Track
from observer.bench.world import DT, World
from observer.motion_model import SIZE
from observer.observer_options import make_filter
from observer.planar_ekf import PlanarEKF
from observer.sensor_models import pose_residual, reading_in_B, rotation_of
from observer.wheel_scale import WheelScale
from services.messages import Array, BaseCommand, Odometry

LAG = 0.5
"""Measurements up to so long after an instant count [s]."""


Batches = list[tuple[float, list[tuple[int, Array]]]]
"""(instant [s], what was measured then: (sensor, value (3)))."""


class Steps(NamedTuple):
    """A filter's pass over n instants.

    Attributes:
        t: instants at which something was measured, (n,) [s].
        x: states after the measurement, (n, SIZE).
        P: their covariances, (n, SIZE, SIZE).
        x_before: states before it, (n, SIZE).
        P_before: their covariances.
        F: derivative of ``x_before[k]`` in ``x[k - 1]``.
    """

    t: Array
    x: Array
    P: Array
    x_before: Array
    P_before: Array
    F: Array


def smoothed(world: World) -> Track:
    """The fixed-lag smoother on a world: poses at the instants of measurements, ``LAG`` later."""
    s = forward(world)
    x, P = backward(s, LAG)
    index = np.rint(s.t / DT).astype(np.int64)
    gaps = np.diff(index)
    n = len(index)
    c, sn = np.cos(x[:, 2]), np.sin(x[:, 2])
    velocity = np.stack([c * x[:, 3] - sn * x[:, 4], sn * x[:, 3] + c * x[:, 4], x[:, 5]], axis=1)
    return Track(
        index=index,
        step=int(gaps[0]) if (gaps == gaps[0]).all() else 0,
        pose=x[:, :3],
        velocity=velocity,
        covariance=P[:, :3, :3],
        slip=np.zeros(n, dtype=np.bool_),
        odometry_nis=np.full(n, math.nan),
        imu_nis=np.full(n, math.nan),
        cost=np.full(n, math.nan),
    )


def forward(world: World) -> Steps:
    """The exact filter over all measurements in the order of sampling; delays do not matter."""
    ekf, start, batches = _ready(world)
    before, x, P = start.t, start.x, start.P
    out: list[tuple[Array, ...]] = []
    for t, batch in batches:
        F = np.eye(SIZE)
        for duration, u in ekf.commands.segments(before, t):
            state = x.tolist()
            step = ekf.motion.jacobian(state, u, duration)
            P = step @ P @ step.T + ekf.motion.process_noise(state[2], duration)
            x, F = np.array(ekf.motion.advance(state, u, duration)), step @ F
        x_before, P_before = x, P
        for sensor, z in batch:
            if sensor == ODOMETRY:
                y = pose_residual(z, x[:3])
                H, R = ekf.odometry.jacobian(x), ekf.odometry.covariance()
            else:
                u = ekf.commands.at(t)
                y = z - ekf.imu.expect(x.tolist(), u)
                H, R = ekf.imu.jacobian(x.tolist(), u), ekf.imu.covariance()
            gain = np.linalg.solve(H @ P @ H.T + R, H @ P).T
            rest = np.eye(SIZE) - gain @ H
            x, P = x + gain @ y, rest @ P @ rest.T + gain @ R @ gain.T
        out.append((x, P, x_before, P_before, F))
        before = t
    times = np.array([t for t, _ in batches])
    return Steps(times, *(np.array(column) for column in zip(*out, strict=True)))


def _ready(world: World) -> tuple[PlanarEKF, Belief, Batches]:
    """The exact filter told all commands, its first belief, and what it is to fuse from there."""
    options = exact_options(world)
    ekf = make_filter(world.truth, options).ekf
    wheels, R_BI = WheelScale(world.truth.odometry.scale), rotation_of(world.truth.imu.rotation)
    delay = options.command_latency + world.truth.platform.command_delay
    start: Belief | None = None
    batches: dict[float, list[tuple[int, Array]]] = {}
    for _, m in sorted(world.arrivals, key=lambda a: a[1].t):
        if isinstance(m, BaseCommand):
            vx, vy, w = m.velocity.tolist()
            ekf.commands.insert(m.t + delay, (vx, vy, w))
        elif isinstance(m, Odometry):
            pose = wheels.correct(m.t, m.pose)
            if start is None:
                start = ekf.first(m.t, pose)
            else:
                batches.setdefault(m.t, []).append((ODOMETRY, pose))
        elif start is not None:
            value = np.array(reading_in_B(R_BI, m.gyro, m.accel))
            batches.setdefault(m.t, []).insert(0, (IMU, value))  # first, as in the product
    assert start is not None
    return ekf, start, list(batches.items())


def backward(s: Steps, lag: float) -> tuple[Array, Array]:
    """State (n, SIZE) and covariance of each instant, given what was measured until ``lag`` later.

    Args:
        s: of the filter.
        lag: [s]; near the end of the run it is less.
    """
    n = len(s.t)
    # gains by correlation, whose entries are alike in size: variances differ by 1e10
    size = np.sqrt(np.maximum(np.einsum("kii->ki", s.P_before[1:]), 1e-30))
    scale = size[:, :, None] * size[:, None, :]
    inverse = np.linalg.pinv(s.P_before[1:] / scale, rcond=1e-11, hermitian=True) / scale
    gain = s.P[:-1] @ np.swapaxes(s.F[1:], 1, 2) @ inverse
    last = np.searchsorted(s.t, s.t + lag + 1e-9) - 1
    x, P = s.x[last], s.P[last]
    for back in range(1, int((last - np.arange(n)).max()) + 1):
        k = last - back  # one step further back for every instant that is not reached yet
        todo = np.flatnonzero(k >= np.arange(n))
        k, g = k[todo], gain[k[todo]]
        x[todo] = s.x[k] + np.einsum("kij,kj->ki", g, x[todo] - s.x_before[k + 1])
        P[todo] = s.P[k] + g @ (P[todo] - s.P_before[k + 1]) @ np.swapaxes(g, 1, 2)
    return x, P
