"""Step out of the way of what comes and does not stop."""

from __future__ import annotations

import math

import numpy as np

from base.behaviour import Senses, Vote
from base.picture import Picture
from base.planar import rotate
from services.messages import Array

_TIMES = np.arange(0.1, 2.01, 0.19)  # looked ahead [s]
_DELAY = 0.3  # until the platform moves as it is told: lag, and jerk limit [s]
_KEEP = 0.15  # wanted between the platform's edge and what moves [m] ...
_STANDING = 0.03  # ... and what stands
_HOLD = 0.4  # it goes on for so long after the last danger, so that nothing flickers [s]
_DIRECTIONS = 24


class GiveWay:
    """Wants nothing until something moving will come too near; then the least change that helps.

    It compares velocities all round, each kept for the two seconds it looks ahead, by how near
    they come to what moves and what stands, and by how much they differ from the present one.

    Args:
        picture: of the laser.
        radius: of the platform [m].
        speed: at most [m/s].
        weight: of its vote, against 1 of those that are not in a hurry.
    """

    name = "give_way"

    def __init__(
        self, picture: Picture, radius: float, speed: float = 0.9, weight: float = 30.0
    ) -> None:
        self._picture, self._radius = picture, radius
        angle = np.arange(_DIRECTIONS) * (2 * math.pi / _DIRECTIONS)
        ring = np.column_stack([np.cos(angle), np.sin(angle)])
        self._choices = np.vstack([np.zeros((1, 2)), *(ring * s * speed for s in (0.35, 0.7, 1.0))])
        self._weight = weight
        self._until = -math.inf
        self._newest = np.zeros(2)

    @property
    def state(self) -> str:
        """``calm`` or ``yielding``."""
        return "yielding" if self._until > -math.inf else "calm"

    def vote(self, now: float, senses: Senses) -> Vote:
        """A velocity out of the way, or nothing."""
        picture = self._picture
        picture.look(now, senses)
        moving = picture.moving
        if picture.trouble or not moving.any():
            self._until = -math.inf
            return Vote(np.zeros(3), 0.0)
        assert picture.scan is not None
        pose = senses.estimate.pose
        velocity = senses.estimate.velocity[:2]
        command = rotate(pose[2], senses.command)[:2]
        late = now - picture.scan.t
        points, speeds = picture.points[moving], picture.velocity[moving]
        away = points + late * speeds - pose[:2]
        present = self._clearance(command[None, :], velocity, away, speeds)[0]
        if present < _KEEP:
            self._until = now + _HOLD
        if now > self._until:
            self._until = -math.inf
            return Vote(np.zeros(3), 0.0)
        choices = np.vstack([self._choices, command])
        clear = self._clearance(choices, velocity, away, speeds)
        standing = picture.points[~moving] - pose[:2]
        standing = standing[np.hypot(standing[:, 0], standing[:, 1]) < 2.2 + self._radius]
        cost = 12.0 * np.maximum(1.3 * _KEEP - clear, 0.0)
        if len(standing):
            still = self._clearance(choices, velocity, standing, np.zeros_like(standing))
            cost += 30.0 * np.maximum(_STANDING - still, 0.0)
        cost += np.hypot(*(choices - command).T) + 0.3 * np.hypot(*(choices - self._newest).T)
        self._newest = choices[int(np.argmin(cost))]
        wanted = rotate(-pose[2], np.array([*self._newest, 0.0]))
        return Vote(wanted, self._weight, reason="gives way")

    def _clearance(self, choices: Array, velocity: Array, away: Array, speeds: Array) -> Array:
        """(n,) least distance from the edge over the time ahead, for each of (n, 2) velocities."""
        late = np.minimum(_TIMES, _DELAY)
        early = np.maximum(_TIMES - _DELAY, 0.0)
        own = late[:, None] * velocity + early[:, None] * choices[:, None, :]  # (n, times, 2)
        theirs = away + _TIMES[:, None, None] * speeds  # (times, points, 2)
        x = theirs[None, :, :, 0] - own[:, :, None, 0]
        y = theirs[None, :, :, 1] - own[:, :, None, 1]
        return np.sqrt((x * x + y * y).min(axis=(1, 2))) - self._radius
