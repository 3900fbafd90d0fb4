"""The camera of a two-armed robot: where the box is, in the platform's frame.

What it says is late, wrong by an error that stays alike for a while and grows with distance, and
missing while too much of the box is out of view: behind palms and forearms, or out of the picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.sensors import Vision as VisionSpec
from services.messages import Vision
from sim.effects import Effects
from sim.sensors import Channel

Array = NDArray[np.float64]

BOX = "box"
ENOUGH = 0.5
"""Share of the points below that must be in view for the box to be found [1]."""
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
POINTS = np.vstack([0.45 * _CORNERS, 0.5 * np.vstack([np.eye(3), -np.eye(3)])])
"""Near the corners and in the middles of the faces, (14, 3), in sizes of the box."""


@dataclass(frozen=True)
class Scene:
    """What the camera looks at, at one instant.

    Attributes:
        R_WB, p_WB: platform, (3, 3) and (3,) [m].
        R_WX, p_WX: box.
        starts, ends: of the axes of what may stand in the way (capsules), each (n, 3) in W [m].
        radii: of these, (n,) [m].
    """

    R_WB: Array
    p_WB: Array
    R_WX: Array
    p_WX: Array
    starts: Array
    ends: Array
    radii: Array


class BoxVision:
    """Pose X_BX of the box.

    The error is an Ornstein-Uhlenbeck process along the axes of B, scaled with the deviation that
    the distance from B to the box over the floor calls for, and up to ``1 / ENOUGH`` times that as
    less of the box is in view. The stated covariance knows distance and view, not ``noise_factor``.

    Args:
        vision: description, already overlaid with the scenario's sensors.
        size: of the box [m].
        dropout: share of sightings lost at random.
        noise_factor: on the stated noise.
        rng: source of noise and losses.
    """

    def __init__(
        self,
        vision: VisionSpec,
        size: tuple[float, float, float],
        dropout: float,
        noise_factor: float,
        rng: np.random.Generator,
    ) -> None:
        self._vision = vision
        self._points = POINTS * np.array(size)
        self._noise_factor = noise_factor
        self._rng = rng
        c = vision.correlation
        self._keep = math.exp(-1.0 / (vision.rate * c)) if c > 0 else 0.0
        self._error = rng.standard_normal(6)
        self.channel: Channel[Vision] = Channel("vision", vision.rate, vision.delay, dropout, rng)

    def step(self, now: float, scene: Callable[[], Scene], effects: Effects) -> list[Vision]:
        """Messages arriving at ``now`` [s]; ``scene`` is asked for when a picture is taken."""
        seen = self.channel.step(now, effects, lambda: self._sample(now, scene(), effects))
        return [message for message in seen if message.name]

    def deviation(self, distance: float) -> tuple[float, float]:
        """Of position [m] and rotation [rad], standard, of a box in full view that far away [m]."""
        v = self._vision
        p, r = (
            a + b * distance + c * distance**2
            for a, b, c in zip(v.noise, v.noise_per_metre, v.noise_per_metre_squared, strict=True)
        )
        return p, r

    def _sample(self, now: float, scene: Scene, effects: Effects) -> Vision:
        """What is seen; without a name if that is nothing."""
        drawn = self._rng.standard_normal(6)
        self._error = self._keep * self._error + math.sqrt(1.0 - self._keep**2) * drawn
        share = 0.0 if "vision" in effects.blinded else self.in_view(scene)
        if share < ENOUGH:
            return Vision(t=now, p=np.zeros(3), R=np.eye(3), covariance=np.eye(6), name="")
        p = scene.R_WB.T @ (scene.p_WX - scene.p_WB)
        spread = np.repeat(self.deviation(math.hypot(p[0], p[1])), 3) / share
        error = self._noise_factor * effects.noise.get("vision", 1.0) * spread * self._error
        R = Rotation.from_rotvec(error[3:]).as_matrix() @ scene.R_WB.T @ scene.R_WX
        return Vision(t=now, p=p + error[:3], R=R, covariance=np.diag(spread**2), name=BOX)

    def in_view(self, scene: Scene) -> float:
        """Share of the box's points that the camera sees [1]; the box itself hides none."""
        camera = scene.p_WB + scene.R_WB @ np.array(self._vision.position)
        points = scene.p_WX + self._points @ scene.R_WX.T
        to = (points - camera) @ scene.R_WB
        bearing = np.arctan2(to[:, 1], to[:, 0])
        seen = np.abs(bearing) <= 0.5 * self._vision.field_of_view
        seen &= np.linalg.norm(to, axis=1) <= self._vision.farthest
        for a, b, r in zip(scene.starts, scene.ends, scene.radii, strict=True):
            seen &= _distances(camera, points, a, b) > r
        return float(np.mean(seen))


def _distances(start: Array, ends: Array, a: Array, b: Array) -> Array:
    """Of the segments from ``start`` to each of ``ends`` (n, 3) to the segment ``a`` ``b`` [m]."""
    d, e, r = ends - start, b - a, start - a
    dd, de, ee = np.sum(d * d, axis=1), d @ e, float(e @ e)
    dr, er = d @ r, float(e @ r)
    # nearest points of the lines, then clamped to the segments, one after the other
    det = np.maximum(dd * ee - de * de, 1e-12)
    s = np.clip((de * er - dr * ee) / det, 0.0, 1.0)
    t = np.clip((de * s + er) / ee, 0.0, 1.0)
    s = np.clip((de * t - dr) / dd, 0.0, 1.0)
    return np.linalg.norm(r + s[:, None] * d - t[:, None] * e, axis=1)
