"""Never so fast that the platform could not stop before anything the laser sees."""

from __future__ import annotations

import math

import numpy as np

from base.behaviour import Senses, Vote
from base.picture import Picture
from deploy.robot import Chassis
from deploy.robot import Platform as Drive
from services.messages import Array

_SECTORS = 72  # around the platform; the tightest point of each limits
_BRAKING = 0.8  # share of the acceleration limit that braking counts on


class Avoid:
    """Half-spaces from the newest scan, without a map; it wants nothing itself.

    Towards each point the platform may go as fast as it can stop from on the way that is left,
    after a step's wait, the drive's lag and the time that the jerk limit takes to build up the
    braking. A point that comes closer takes its part of that way. Without a scan to trust the
    platform stands.

    Args:
        picture: of the laser.
        drive: description.
        chassis: description.
        period: between commands [s].
        margin: kept to everything [m].
    """

    name = "avoid"

    def __init__(
        self,
        picture: Picture,
        drive: Drive,
        chassis: Chassis,
        period: float,
        margin: float = 0.01,
    ) -> None:
        self._picture = picture
        self._keep = chassis.radius + margin
        self._fastest = max(drive.speed_limit[:2])
        self._braking = _BRAKING * min(drive.acceleration_limit[:2])
        build_up = max(
            a / (2 * j) for a, j in zip(drive.acceleration_limit, chassis.jerk_limit, strict=True)
        )
        self._lag = drive.lag
        self._wait = period + drive.command_delay + drive.lag + build_up
        self._state = "watching"

    @property
    def state(self) -> str:
        """``watching``, or ``blind``."""
        return self._state

    def vote(self, now: float, senses: Senses) -> Vote:
        """The limits, of weight 0; no motion at all, and why, while the laser is not trusted."""
        picture = self._picture
        picture.look(now, senses)
        self._state = "blind" if picture.trouble else "watching"
        if picture.trouble:
            return Vote(np.zeros(3), 0.0, bound=np.zeros(3), reason=picture.trouble)
        return Vote(np.zeros(3), 0.0, limits=self._limits(now, senses))

    def _limits(self, now: float, senses: Senses) -> Array:
        """(k, 4) rows (a, b), of those that can matter."""
        picture, estimate = self._picture, senses.estimate
        assert picture.scan is not None
        pose = estimate.pose + (now - estimate.t) * estimate.velocity
        away = picture.points + (now - picture.scan.t) * picture.velocity - pose[:2]
        distance = np.hypot(away[:, 0], away[:, 1])
        close = distance < self._keep + 2.5
        away, distance = away[close], np.maximum(distance[close], 1e-3)
        n = away / distance[:, None]
        closing = np.maximum(-(n * picture.velocity[close]).sum(axis=1), 0.0)
        command = _turn(pose[2], senses.command)
        # still faster than commanded, as when braking, the lag carries it on
        carried = self._lag * np.maximum(n @ (estimate.velocity[:2] - command), 0.0)
        wait = self._wait + closing / self._braking
        left = np.maximum(distance - self._keep - carried - closing * self._wait, 0.0)
        b = self._braking * (np.sqrt(wait**2 + 2 * left / self._braking) - wait)
        near = b < 1.5 * self._fastest
        n, b = n[near], b[near]
        # sorted by how tight: the first of each sector is the one that counts
        order = np.argsort(b, kind="stable")
        bearing = np.arctan2(n[order, 1], n[order, 0])
        sector = np.floor(bearing * (_SECTORS / (2 * math.pi))).astype(int)
        first = order[np.unique(sector, return_index=True)[1]]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        return np.column_stack(
            [
                c * n[first, 0] + s * n[first, 1],
                -s * n[first, 0] + c * n[first, 1],
                np.zeros(len(first)),
                b[first],
            ]
        )


def _turn(heading: float, twist: Array) -> Array:
    """(2,) the translation of a velocity (3,) in B, expressed in O."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * twist[0] - s * twist[1], s * twist[0] + c * twist[1]])
