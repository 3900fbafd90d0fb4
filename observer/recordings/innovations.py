"""A recording through the filter alone, in the order of stamps: every innovation with its S.

What the filter knows does not depend on when things arrived, so this is what a replay comes to once
everything late has been worked in; and it is fast, for there is no output between measurements.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from deploy.robot import MobileBase
from observer.belief import IMU, NAMES, ODOMETRY, SPEED, Event
from observer.metrics import nees
from observer.observer_options import ObserverOptions, make_filter
from observer.recordings.recording import Recording, Samples
from observer.sensor_models import reading_in_B, rotation_of
from observer.update import nis3
from observer.wheel_scale import WheelScale
from services.messages import Array


@dataclass(frozen=True)
class Innovations:
    """Innovations of one sensor: measured minus predicted, before the measurement is fused.

    Attributes:
        t: stamps (n,) [s].
        value: innovation (n, 3); odometry [m, m, rad], speed [m/s, m/s, rad/s], imu (gyro z, accel
            x, accel y) [rad/s, m/s^2, m/s^2].
        covariance: of it as the filter expects it, S (n, 3, 3).
        refused: whether the gate refused it (n,).
    """

    t: Array
    value: Array
    covariance: Array
    refused: np.ndarray[Any, np.dtype[np.bool_]]

    def __len__(self) -> int:
        return len(self.t)

    def after(self, start: float) -> Innovations:
        """Those of ``start`` [s] and later."""
        k = self.t >= start
        return Innovations(self.t[k], self.value[k], self.covariance[k], self.refused[k])

    @property
    def sigma(self) -> Array:
        """Standard deviation expected (n, 3), in the units of ``value``."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @property
    def nis(self) -> Array:
        """Normalised squares (n,); their mean is 3 if the filter is honest."""
        return nees(self.value, self.covariance)

    @property
    def log_likelihood(self) -> Array:
        """log N(y; 0, S) of each (n,)."""
        volume = np.linalg.slogdet(2.0 * math.pi * self.covariance)[1]
        return np.asarray(-0.5 * (self.nis + volume))


@dataclass(frozen=True)
class Measurements:
    """A recording as the filter takes it.

    Attributes:
        events: in the order of stamps; the IMU along the axes of B, wheels of the right size.
        commands: (t [s], V_OB_B), in the order of stamps.
    """

    events: list[Event]
    commands: list[tuple[float, tuple[float, float, float]]]


def measurements(recording: Recording) -> Measurements:
    """What a recording measured, in the frames of the filter."""
    base = recording.base
    events: list[Event] = []
    if recording.odometry is not None:
        wheels = WheelScale(base.odometry.scale)
        events += _events(recording.odometry, ODOMETRY, wheels.correct)
    if recording.speeds is not None:
        distance, turn = base.odometry.scale
        events += _events(recording.speeds, SPEED, lambda _, v: v / (distance, distance, turn))
    if recording.imu is not None:
        R_BI = rotation_of(base.imu.rotation)
        events += _events(
            recording.imu, IMU, lambda _, v: np.array(reading_in_B(R_BI, v[:3], v[3:]))
        )
    events.sort(key=lambda e: e[:2])
    c = recording.commands
    rows = [] if c is None else zip(c.t.tolist(), c.values.tolist(), strict=True)
    return Measurements(events, [(t, (v[0], v[1], v[2])) for t, v in rows])


def _events(samples: Samples, sensor: int, of: Callable[[float, Array], Array]) -> list[Event]:
    rows = zip(samples.t.tolist(), samples.values, strict=True)
    return [Event(t, sensor, of(t, np.asarray(v))) for t, v in rows]


def innovations(
    given: Measurements, base: MobileBase, options: ObserverOptions | None = None
) -> dict[str, Innovations]:
    """Innovations by sensor (``odometry``, ``speed``, ``imu``); a silent one is left out.

    Args:
        given: by `measurements`.
        base: the platform as the filter shall believe it.
        options: of the observer.
    """
    options = options or ObserverOptions()
    delayed = make_filter(base, options)
    ekf, gates = delayed.ekf, options.filter
    delay = options.command_latency + base.platform.command_delay
    for t, velocity in given.commands:
        ekf.commands.insert(t + delay, velocity)
    rows: dict[int, list[tuple[Any, ...]]] = {ODOMETRY: [], SPEED: [], IMU: []}
    for event in given.events:
        silent = delayed.belief.t if delayed.started else -math.inf
        afresh = event.t - silent > gates.gap
        if not delayed.add(event.sensor, event.t, event.z, event.t):
            continue
        delayed.settle()
        if afresh and event.sensor == ODOMETRY:
            continue  # it set the pose; there was nothing to compare it with
        nis = nis3(ekf.S, ekf.y)
        gate = gates.imu_gate if event.sensor == IMU else gates.odometry_gate
        rows[event.sensor].append((event.t, ekf.y.copy(), ekf.S.copy(), nis > gate))
    return {
        NAMES[sensor]: Innovations(*(np.array(column) for column in zip(*found, strict=True)))
        for sensor, found in rows.items()
        if found
    }
