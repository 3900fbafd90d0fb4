"""Sensor models: sample the truth, add bias and noise, quantise, lose some, deliver late."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.robot import MobileBase
from services.messages import Imu, Message, Odometry
from sim.effects import GRAVITY, Effects
from sim.scenario import Sensors

Array = NDArray[np.float64]
M = TypeVar("M", bound=Message)


class Channel(Generic[M]):
    """Samples at a fixed rate and hands each sample out when its delay has passed.

    Args:
        name: of the sensor: what effects and losses are looked up by.
        rate: [Hz].
        delay: sample to arrival [s].
        loss: share of samples lost at random.
        rng: source of the losses.
    """

    def __init__(
        self, name: str, rate: float, delay: float, loss: float, rng: np.random.Generator
    ) -> None:
        self._name = name
        self._period = 1.0 / rate
        self._delay = delay
        self._loss = loss
        self._rng = rng
        self._samples: int | None = None
        self._waiting: list[tuple[float, int, M]] = []

    @property
    def due(self) -> float:
        """Robot time before which ``step`` has nothing to do [s]."""
        if self._samples is None:
            return -math.inf
        sample = self._samples * self._period
        return min(sample, self._waiting[0][0]) if self._waiting else sample

    def step(self, now: float, effects: Effects, sample: Callable[[], M]) -> list[M]:
        """Sample if it is time to, and return the messages that arrive by ``now`` [s]."""
        if self._samples is None:  # robot time need not start at 0
            self._samples = math.ceil(now / self._period - 1e-6)
        if now + 1e-9 >= self._samples * self._period:
            self._samples += 1
            message = sample()
            lost = self._loss > 0 and self._rng.random() < self._loss
            if not lost and self._name not in effects.dropout:
                arrival = message.t + self._delay + effects.delay.get(self._name, 0.0)
                heapq.heappush(self._waiting, (arrival, self._samples, message))
        out = []
        while self._waiting and self._waiting[0][0] <= now + 1e-9:
            out.append(heapq.heappop(self._waiting)[2])
        return out


class Wheels:
    """The pose as the wheels count it, increment by increment: blind to slip, wrong by a scale.

    Args:
        scale: what is read over what is true, of distance and of heading turned.
    """

    def __init__(self, scale: tuple[float, float]) -> None:
        self._scale = scale
        self._slipped: Array | None = None
        self._last: Array | None = None
        self._pose = np.zeros(3)

    def slip(self, slip: Array) -> None:
        """Take in motion that the wheels do not see: in W, shape (2,) [m]."""
        unseen = np.array([*slip, 0.0])
        self._slipped = unseen if self._slipped is None else self._slipped + unseen

    def roll(self, pose: Array) -> Array:
        """Take in the motion since the last call; ``slip`` says how much of it they do not see.

        Args:
            pose: true X_WB now, (3,).

        Returns:
            X_OB as counted, (3,), to be read only; O is W at the first call.
        """
        seen = pose if self._slipped is None else pose - self._slipped
        if self._scale == (1.0, 1.0):
            return seen
        if self._last is None:
            self._last, self._pose = seen, seen
        distance, turn = self._scale
        step = seen - self._last
        # headings half-way, of the truth and as counted, between which the increment is turned
        true = self._last[2] + 0.5 * step[2]
        angle = self._pose[2] + 0.5 * turn * step[2] - true
        c, s = distance * math.cos(angle), distance * math.sin(angle)
        moved = [c * step[0] - s * step[1], s * step[0] + c * step[1], turn * step[2]]
        self._last, self._pose = seen, self._pose + np.array(moved)
        return self._pose


class OdometrySensor:
    """Pose from the wheels: quantised, late, and blind to slip.

    Args:
        robot: description, already overlaid with the scenario's sensors.
        sensors: noise and losses of the scenario.
        rng: source of noise.
    """

    def __init__(self, robot: MobileBase, sensors: Sensors, rng: np.random.Generator) -> None:
        self._enabled = sensors.odometry.enabled
        self._noise = np.array(sensors.odometry.noise)
        self._resolution = robot.odometry.resolution
        self._rng = rng
        self._channel: Channel[Odometry] = Channel(
            "odometry", robot.odometry.rate, robot.odometry.delay, sensors.odometry.dropout, rng
        )
        self._wheels = Wheels(robot.odometry.scale)

    def step(self, now: float, dt: float, pose: Array, effects: Effects) -> list[Odometry]:
        """Messages arriving at ``now``; ``pose`` is X_WB as (x, y, heading)."""
        if effects.slips:
            self._wheels.slip(effects.slip * dt)
        counted = self._wheels.roll(pose)
        if not self._enabled:
            return []
        return self._channel.step(now, effects, lambda: self._sample(now, counted, effects))

    def _sample(self, now: float, counted: Array, effects: Effects) -> Odometry:
        noise = self._noise * effects.noise.get("odometry", 1.0)
        seen = counted + noise * self._rng.standard_normal(3)
        for i, q in enumerate(self._resolution):
            if q > 0:
                seen[i] = round(seen[i] / q) * q
        return Odometry(t=now, pose=seen)


class ImuSensor:
    """Gyro and accelerometer at a lever arm from the platform's centre, axes along B.

    Like real ones they do not sample an instant but the mean over their sampling period: a gyro
    the angle turned, an accelerometer the velocity gained. A message is stamped with the middle
    of that period. The accelerometer reads specific force: acceleration minus gravity, with the
    centripetal and angular-acceleration terms of its position. On a tilted floor gravity is not on
    its z alone; what leaks into x and y turns with the heading.

    Args:
        robot: description, already overlaid with the scenario's sensors.
        sensors: losses of the scenario.
        noise_factor: on the stated noise.
        rng: source of bias and noise.
        floor_tilt: rise of the floor along x and y of W [rad].
    """

    def __init__(
        self,
        robot: MobileBase,
        sensors: Sensors,
        noise_factor: float,
        rng: np.random.Generator,
        floor_tilt: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        imu = robot.imu
        self._enabled = sensors.imu.enabled
        self._position = imu.position[:2]
        self._gyro_noise = imu.gyro_noise * noise_factor
        self._accel_noise = imu.accel_noise * noise_factor
        self._gyro_bias = imu.gyro_bias * rng.standard_normal(3)
        self._accel_bias = imu.accel_bias * rng.standard_normal(3)
        self._rng = rng
        up_x, up_y = math.sin(floor_tilt[0]), math.sin(floor_tilt[1])
        self._up = (up_x, up_y, math.sqrt(1.0 - up_x * up_x - up_y * up_y))
        self._R_IB = Rotation.from_euler("xyz", imu.rotation).as_matrix().T
        self._channel: Channel[Imu] = Channel("imu", imu.rate, imu.delay, sensors.imu.dropout, rng)
        self._sum = [0.0, 0.0, 0.0]
        self._ticks = 0
        self._heading: float | None = None
        self._began: float | None = None

    def step(
        self, now: float, pose: Array, velocity: Array, acceleration: Array, effects: Effects
    ) -> list[Imu]:
        """Messages arriving at ``now``; pose X_WB and its derivatives in W, each shape (3,)."""
        if not self._enabled:
            return []
        heading = float(pose[2])
        c, s = math.cos(heading), math.sin(heading)
        ax, ay, alpha = acceleration.tolist()
        w = float(velocity[2])
        px, py = self._position
        up_x, up_y, up_z = self._up
        ax, ay = ax + GRAVITY * up_x, ay + GRAVITY * up_y
        self._sum[0] += c * ax + s * ay - alpha * py - w * w * px
        self._sum[1] += -s * ax + c * ay + alpha * px - w * w * py
        self._sum[2] += GRAVITY * up_z + effects.vertical
        self._ticks += 1
        return self._channel.step(now, effects, lambda: self._sample(now, heading, effects))

    def _sample(self, now: float, heading: float, effects: Effects) -> Imu:
        """The means since the last sample."""
        period = now - self._began if self._began is not None else 0.0
        turned = 0.0 if self._heading is None or period <= 0 else heading - self._heading
        rate = turned / period if period > 0 else 0.0
        mean = np.array(self._sum) / self._ticks
        self._heading, self._began, self._ticks, self._sum = heading, now, 0, [0.0, 0.0, 0.0]
        factor = effects.noise.get("imu", 1.0)
        gyro = self._R_IB @ np.array([0.0, 0.0, rate]) + self._gyro_bias + effects.gyro_bias
        accel = self._R_IB @ mean + self._accel_bias + effects.accel_bias
        gyro += factor * self._gyro_noise * self._rng.standard_normal(3)
        accel += factor * self._accel_noise * self._rng.standard_normal(3)
        return Imu(t=max(now - 0.5 * period, 0.0), gyro=gyro, accel=accel)
