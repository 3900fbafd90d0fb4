"""All that a controller of the grasp may know at one tick."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm.grasping.feel import Feel
from arm.grasping.model import Palms
from arm.model import Base
from services.messages import ObjectEstimate

Array = NDArray[np.float64]

SQUARE, OBLIQUE = 0.2, 0.3
"""A box that was turned further than the one is come at up to the other off the square [rad]."""


@dataclass
class BoxPlace:
    """The box as it is believed to be, in B.

    Attributes:
        p: p_BX [m].
        R: R_BX, turned by quarters about z so that x leads from the face the arms reach around to
            the one behind it, and y to the left palm.
        velocity: of the box in B, were it at rest in O, shape (3,) [m/s].
        size: along x, y, z of ``R`` [m].
        sd: of its position along axes of B, shape (3,) [m], and of its yaw [rad], shape (1,).
        ahead: from where the way to it is free, to the box; along x of ``R`` where nobody knows.
    """

    p: Array
    R: Array
    velocity: Array
    size: Array
    sd: Array
    ahead: Array | None = None

    @property
    def across(self) -> Array:
        """Horizontal unit vector from the box to the left palm: the line's direction."""
        n = np.array([self.R[0, 1], self.R[1, 1], 0.0])
        return n / max(float(np.linalg.norm(n)), 1e-9)

    @property
    def along(self) -> Array:
        """Horizontal unit vector across the line, ahead."""
        n = self.across
        return np.array([n[1], -n[0], 0.0])

    @property
    def approach(self) -> float:
        """Heading in B in which the platform best comes at it [rad].

        Square on, unless the box was turned: where the robot would stand then the table may be.
        """
        into = math.atan2(self.along[1], self.along[0])
        free = into if self.ahead is None else math.atan2(self.ahead[1], self.ahead[0])
        off = math.remainder(free - into, math.tau)
        return into + math.copysign(min(max(abs(off) - SQUARE, 0.0), OBLIQUE), off)

    @property
    def tilt(self) -> float:
        """Angle between its z and the vertical [rad]."""
        return float(np.arccos(np.clip(self.R[2, 2], -1.0, 1.0)))


class Faces:
    """Which of the box's four faces the arms reach around.

    The way to the box is free where its front looked when it was first seen: a box that was thrown
    about on its table is taken by whatever face looks there now.

    Attributes:
        turn: R_XF, F being the box as it looks from the face in use: by quarters about z.
    """

    FIRM = 0.12
    """Another face must look there by so much more than 45 degrees allow [rad]."""

    def __init__(self) -> None:
        self.turn = np.eye(3)
        self._ahead: Array | None = None

    def choose(self, R: Array, away: Array, free: bool) -> None:
        """Look at the box anew.

        Args:
            R: R_OX.
            away: from the robot to the box, in O, shape (3,) [m].
            free: no palm is on it; otherwise the face stays what it is.
        """
        if self._ahead is None:
            if float(R[:2, 0] @ away[:2]) < 0.0:  # from behind, it is its own mirror image
                self.turn = _quarters(2)
            self._ahead = R @ self.turn[:, 0]
        x = R.T @ self._ahead
        now = self.turn.T @ x
        if free and abs(math.atan2(now[1], now[0])) > 0.25 * math.pi + self.FIRM:
            self.turn = _quarters(round(math.atan2(x[1], x[0]) / (0.5 * math.pi)))

    @property
    def ahead(self) -> Array:
        """Into the face, by which the way there is free, in O, shape (3,) [1]."""
        assert self._ahead is not None
        return self._ahead

    def size(self, size: Array) -> Array:
        """Of the box along x, y, z of F, from that along those of X [m]."""
        return np.asarray(np.abs(self.turn.T @ size))


def box_in_platform(
    seen: ObjectEstimate, base: Base, size: Array, faces: Faces, free: bool
) -> BoxPlace:
    """The box in B, from where it is in O [m] and how the platform moves.

    Args:
        seen: by the observer.
        base: motion of the platform.
        size: of the box along x, y, z of X [m].
        faces: what it is taken by.
        free: no palm is on it.
    """
    c, s = np.cos(base.pose[2]), np.sin(base.pose[2])
    R_BO = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    p = R_BO @ (seen.p - np.array([base.pose[0], base.pose[1], 0.0]))
    v = R_BO @ np.array([base.velocity[0], base.velocity[1], 0.0])
    w = float(base.velocity[2])
    velocity = -v - np.array([-w * p[1], w * p[0], 0.0])
    if seen.held:  # it comes along
        velocity = np.zeros(3)
    faces.choose(seen.R, R_BO.T @ p, free)
    P = seen.covariance
    variance = np.diag(R_BO @ P[:3, :3] @ R_BO.T)
    sd = np.sqrt(np.maximum(np.append(variance, P[5, 5]), 0.0))
    R = R_BO @ seen.R @ faces.turn
    return BoxPlace(p, R, velocity, faces.size(size), sd, R_BO @ faces.ahead)


def _quarters(n: int) -> Array:
    """Rotation by n quarters about z."""
    c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[n % 4]
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def between(palms: Palms, size: Array) -> BoxPlace:
    """The box in B if nothing is known but that it is held: upright, in the middle of the palms.

    Args:
        palms: what holds it.
        size: of the box along x, y, z of its place's ``R`` [m].
    """
    gap = palms.p[0] - palms.p[1]
    y = np.array([gap[0], gap[1], 0.0]) / max(float(np.hypot(gap[0], gap[1])), 1e-9)
    z = np.array([0.0, 0.0, 1.0])
    R = np.column_stack([np.cross(y, z), y, z])
    return BoxPlace(0.5 * (palms.p[0] + palms.p[1]), R, np.zeros(3), size, np.zeros(4))


@dataclass
class Scene:
    """One tick.

    Attributes:
        dt: since the last [s].
        t: robot time [s].
        palms: kinematics at the measured joints.
        feel: load cells.
        base: motion of the platform in O.
        box: None while it has not been seen, or not for too long.
        box_age: of the newest sighting [s]; infinite if there never was one.
        size: of the box as the task states it, along x, y, z of its place's ``R`` [m].
        half_palm: of a palm along x, y, z of P [m].
    """

    dt: float
    t: float
    palms: Palms
    feel: Feel
    base: Base
    box: BoxPlace | None
    box_age: float
    size: Array
    half_palm: Array

    @property
    def width(self) -> float:
        """Distance between the palms' faces [m]."""
        gap = self.palms.p[0] - self.palms.p[1]
        n = np.array([0.0, 1.0, 0.0]) if self.box is None else self.box.across
        return float(gap @ n) - 2.0 * float(self.half_palm[1])
