"""The ring of bumpers: switches that close where the platform touches an obstacle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from deploy.sensors import Bumper as BumperSpec
from services.messages import Bumper
from sim.effects import Effects
from sim.obstacles import Obstacles
from sim.sensors import Channel

Array = NDArray[np.float64]
TRAVEL = 0.003
"""The rubber stands out by this much in front of the platform's circle [m]."""


class BumperSensor:
    """Which parts of the ring are pressed.

    Args:
        bumper: description, already overlaid with the scenario's sensors.
        radius: of the platform's circle [m].
        obstacles: what it may touch.
        dropout: share of messages lost at random.
        rng: source of losses.
    """

    def __init__(
        self,
        bumper: BumperSpec,
        radius: float,
        obstacles: Obstacles,
        dropout: float,
        rng: np.random.Generator,
    ) -> None:
        self._part = 2 * math.pi / bumper.parts
        self._count = bumper.parts
        self._reach = radius + TRAVEL
        self._obstacles = obstacles
        self.channel: Channel[Bumper] = Channel("bumper", bumper.rate, 0.0, dropout, rng)

    def step(self, now: float, pose: Array, effects: Effects) -> list[Bumper]:
        """Messages arriving at ``now`` [s]; ``pose`` is X_WB as (x, y, heading)."""
        return self.channel.step(now, effects, lambda: self._sample(now, pose))

    def _sample(self, now: float, pose: Array) -> Bumper:
        pressed: list[float] = []
        if len(self._obstacles):
            distance, toward = self._obstacles.at(now).nearest(pose[:2])
            touching = toward[distance <= self._reach]
            bearings = np.arctan2(touching[:, 1], touching[:, 0]) - pose[2]
            parts = np.unique(np.rint(bearings / self._part).astype(int) % self._count)
            pressed = [math.remainder(p * self._part, 2 * math.pi) for p in parts.tolist()]
        return Bumper(t=now, pressed=np.array(pressed, dtype=float))
