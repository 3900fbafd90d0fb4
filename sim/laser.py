"""The planar laser scanner: ranges to the obstacles by ray casting."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from deploy.sensors import Laser
from services.messages import Scan
from sim.effects import Effects
from sim.obstacles import Obstacles
from sim.sensors import Channel

Array = NDArray[np.float64]
DIGITS = 3
"""Ranges are told to the millimetre."""


class LaserSensor:
    """Ranges with noise, to the millimetre, late.

    All beams of a scan are of one instant. A blinded laser reports 0 in every beam, as one with a
    covered window does.

    Args:
        laser: description, already overlaid with the scenario's sensors.
        obstacles: what it may see.
        dropout: share of scans lost at random.
        noise_factor: on the stated noise.
        rng: source of noise and losses.
    """

    def __init__(
        self,
        laser: Laser,
        obstacles: Obstacles,
        dropout: float,
        noise_factor: float,
        rng: np.random.Generator,
    ) -> None:
        self._laser = laser
        self._obstacles = obstacles
        self._noise = laser.noise * noise_factor
        self._rng = rng
        turn = laser.field_of_view > 2 * math.pi - 0.5 * laser.increment
        count = round(laser.field_of_view / laser.increment) + (0 if turn else 1)
        self._start = -0.5 * laser.increment * (count - (0 if turn else 1))
        self._bearings = self._start + laser.increment * np.arange(count)
        self.channel: Channel[Scan] = Channel("laser", laser.rate, laser.delay, dropout, rng)

    def step(self, now: float, pose: Array, effects: Effects) -> list[Scan]:
        """Messages arriving at ``now`` [s]; ``pose`` is X_WB as (x, y, heading)."""
        return self.channel.step(now, effects, lambda: self._sample(now, pose, effects))

    def _sample(self, now: float, pose: Array, effects: Effects) -> Scan:
        laser = self._laser
        noise = self._noise * effects.noise.get("laser", 1.0)
        drawn = self._rng.standard_normal(len(self._bearings))
        ranges: Array
        if "laser" in effects.blinded:
            ranges = np.zeros(len(self._bearings))
        elif len(self._obstacles):
            c, s = math.cos(pose[2]), math.sin(pose[2])
            x, y = laser.position
            origin = np.array([pose[0] + c * x - s * y, pose[1] + s * x + c * y])
            true = self._obstacles.at(now).cast(origin, pose[2] + self._bearings, laser.farthest)
            seen = (true + noise * drawn).clip(0.0, laser.farthest).round(DIGITS)
            ranges = np.where(true < laser.farthest, seen, laser.farthest)
        else:
            ranges = np.full(len(self._bearings), laser.farthest)
        return Scan(
            t=now,
            start=self._start,
            increment=laser.increment,
            ranges=ranges,
            farthest=laser.farthest,
        )
