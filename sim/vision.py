"""The camera: finds the board by its markers and says where it is in the platform's frame."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.sensors import Vision as VisionSpec
from services.messages import Vision
from sim.effects import Effects
from sim.obstacles import Obstacles
from sim.sensors import Channel

Array = NDArray[np.float64]

BOARD = "board"
GRAZING = math.radians(75.0)
"""A marker seen further from square-on than this is not found [rad]."""
BEHIND = 0.03
"""What is this near to a marker carries it, and does not hide it [m]."""


class VisionSensor:
    """Pose X_BS of the board from the nearest marker that is in view.

    A marker is in view if it is near enough, in the field of view, not too oblique, and no
    obstacle higher than the lower of camera and marker stands in between. The error grows with the
    distance of the marker; a wrong rotation moves the board's frame, which is elsewhere than the
    marker, with it, as the message's covariance says.

    Args:
        vision: description, already overlaid with the scenario's sensors.
        R_WS: true rotation of the board, (3, 3).
        p_WS: true position of the board, (3,) [m].
        markers: along x_S [m].
        obstacles: what may hide them.
        dropout: share of sightings lost at random.
        noise_factor: on the stated noise; the covariance does not know of it.
        rng: source of noise and losses.
    """

    def __init__(
        self,
        vision: VisionSpec,
        R_WS: Array,
        p_WS: Array,
        markers: Sequence[float],
        obstacles: Obstacles,
        dropout: float,
        noise_factor: float,
        rng: np.random.Generator,
    ) -> None:
        self._vision = vision
        self._R_WS, self._p_WS = R_WS, p_WS
        self._markers = [np.array([m, 0.0, 0.0]) for m in markers]
        self._obstacles = obstacles.higher_than(min(vision.position[2], float(p_WS[2])))
        self._noise_factor = noise_factor
        self._rng = rng
        self.channel: Channel[Vision] = Channel("vision", vision.rate, vision.delay, dropout, rng)

    def step(self, now: float, pose: Array, effects: Effects) -> list[Vision]:
        """Messages arriving at ``now`` [s]; ``pose`` is X_WB as (x, y, heading)."""
        seen = self.channel.step(now, effects, lambda: self._sample(now, pose, effects))
        return [message for message in seen if message.name]

    def _sample(self, now: float, pose: Array, effects: Effects) -> Vision:
        """What is seen; without a name if that is nothing."""
        drawn = self._rng.standard_normal(6)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        R_WB = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        p_WB = np.array([pose[0], pose[1], 0.0])
        p_WC = p_WB + R_WB @ np.array(self._vision.position)
        p_WS = self._p_WS if effects.board is None else self._p_WS + effects.board
        in_view = [] if "vision" in effects.blinded else self._in_view(now, R_WB, p_WC, p_WS)
        if not in_view:
            return Vision(t=now, p=np.zeros(3), R=np.eye(3), covariance=np.eye(6), name="")
        distance, p_SM = min(in_view, key=lambda item: item[0])
        R_BS = R_WB.T @ self._R_WS
        arm = R_BS @ p_SM
        p_BM = R_WB.T @ (p_WS - p_WB) + arm
        deviation = [
            a + b * distance
            for a, b in zip(self._vision.noise, self._vision.noise_per_metre, strict=True)
        ]
        spread = np.repeat(deviation, 3)
        error = self._noise_factor * effects.noise.get("vision", 1.0) * spread * drawn
        R = Rotation.from_rotvec(error[3:]).as_matrix() @ R_BS
        J = np.eye(6)
        J[:3, 3:] = _cross(arm)
        return Vision(
            t=now,
            p=p_BM + error[:3] - R @ p_SM,
            R=R,
            covariance=J @ np.diag(spread**2) @ J.T,
            name=BOARD,
        )

    def _in_view(
        self, now: float, R_WB: Array, p_WC: Array, p_WS: Array
    ) -> list[tuple[float, Array]]:
        """Distance from the camera [m] and p_SM of every marker in view."""
        out = []
        for p_SM in self._markers:
            to = p_WS + self._R_WS @ p_SM - p_WC
            distance = float(np.linalg.norm(to))
            ahead = R_WB.T @ to
            bearing = math.atan2(ahead[1], ahead[0])
            square = float(-to @ self._R_WS[:, 2]) / max(distance, 1e-9)
            if (
                distance <= self._vision.farthest
                and abs(bearing) <= 0.5 * self._vision.field_of_view
                and square >= math.cos(GRAZING)
                and not self._hidden(now, p_WC[:2], to[:2])
            ):
                out.append((distance, p_SM))
        return out

    def _hidden(self, now: float, origin: Array, to: Array) -> bool:
        if not len(self._obstacles):
            return False
        bearing = np.array([math.atan2(to[1], to[0])])
        free = float(self._obstacles.at(now).cast(origin, bearing)[0])
        return free < math.hypot(to[0], to[1]) - BEHIND


def _cross(v: Array) -> Array:
    """The matrix of the cross product with ``v``, (3, 3)."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
