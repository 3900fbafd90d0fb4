"""Where a box is: vision, odometry and touch in one filter, with a covariance that can be believed.

A camera's error stays alike for a second, so that averaging pictures as if they erred anew would
claim what nobody knows. The error itself is therefore part of the state: six Ornstein-Uhlenbeck
processes of unit variance, scaled by what each picture says of its deviation. Touch (``PalmTouch``)
sees only along the palms' normal: across it the filter keeps what vision says.

State: position of the box in O, a small rotation in O, the camera's error; (12,).
"""

from __future__ import annotations

import math
from bisect import bisect_left

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.sensors import Vision as VisionSpec
from observer.palm_touch import Touch
from services.messages import Estimate, ObjectEstimate, Vision

Array = NDArray[np.float64]

SPOILT = 1.25
"""A camera's true noise over its stated one, as a guess; a good one has 1, a poor one 1.5."""
PICTURE = np.array([3e-4] * 3 + [1e-3] * 3)
"""What of a picture's error is new each time [m, rad]."""
DRIFT = 1e-4, 2e-5
"""Variance that odometry adds for each metre driven [m^2/m], and radian turned [rad^2/rad]."""
REST = 1e-7, 1e-7
"""Variance that a box at rest gains [m^2/s, rad^2/s]."""
LOST = 0.01, 0.003
"""While the platform does not know where it is, after a push [m^2/s, rad^2/s]."""
LOOSE = 1.0, 4.0
"""And one that moves by itself, of its velocity's square [m^2/s^2, rad^2/s^2]."""
SETTLES = 0.5
"""A box that was pushed comes to rest in this time [s]."""
SLIPS = 0.3
"""Share of the palms' way by which a held box may stay behind [1]."""
GATE = 32.9
"""Of a sighting's squared, normalised innovation, six degrees of freedom: one in 1e5 [1]."""
BELIEVED = 3
"""Sightings in a row beyond the gate that mean: it has moved."""
PERIOD = 0.008
"""Between messages [s]."""
HISTORY = 0.3
"""How long poses of the platform are remembered [s]."""
TOUCH_PERIOD = 0.04
"""Between uses of touch [s]."""
_P, _R, _E = slice(0, 3), slice(3, 6), slice(6, 12)


class ObjectEstimator:
    """Follows one box.

    Args:
        vision: description of the camera.
        name: of the object, as the camera says it.
    """

    def __init__(self, vision: VisionSpec, name: str = "box") -> None:
        self._name = name
        self._correlation = vision.correlation
        self._poses: list[tuple[float, Array]] = []
        self._p = np.zeros(3)
        self._R = np.eye(3)
        self._e = np.zeros(6)
        self._P = np.diag([100.0] * 3 + [10.0] * 3 + [1.0] * 6)
        self._t: float | None = None
        self._error_t: float | None = None
        self._seen = -math.inf
        self._due = 0.0
        self._touch_due = 0.0
        self._doubted = 0
        self._moving_until = -math.inf
        self._grip: tuple[Array, Array] | None = None
        self.taken = 0
        self.refused = 0

    def step(
        self, estimate: Estimate, sightings: list[Vision], touch: Touch | None
    ) -> ObjectEstimate | None:
        """Take in what has come; returns a message when one is due and the object was ever seen.

        Args:
            estimate: of the platform, now.
            sightings: pictures that arrived since the last step.
            touch: what the palms feel, now; None if nothing is known of them.
        """
        now = estimate.t
        self._remember(now, estimate.pose)
        if self._t is not None:
            self._predict(now, touch, not estimate.valid)
        for seen in sightings:
            if seen.name == self._name:
                self._see(seen)
        if self._t is None:
            if self.taken == 0:
                return None
            self._t = now
        if touch is not None and now + 1e-9 >= self._touch_due:
            self._touch_due = now + TOUCH_PERIOD
            self._feel(touch)
        if now + 1e-9 < self._due:
            return None
        self._due = now + PERIOD
        return ObjectEstimate(
            t=now,
            p=self._p.copy(),
            R=self._R.copy(),
            covariance=self._P[:6, :6].copy(),
            name=self._name,
            held=self._grip is not None,
            age=now - self._seen,
            taken=self.taken,
            refused=self.refused,
        )

    # --- motion -----------------------------------------------------------------------------

    def _remember(self, now: float, pose: Array) -> None:
        self._poses.append((now, pose))
        if self._poses[0][0] < now - 2 * HISTORY:
            self._poses = self._poses[bisect_left(self._poses, now - HISTORY, key=_first) :]

    def _predict(self, now: float, touch: Touch | None, lost: bool) -> None:
        """Bring the state to ``now``: at rest, rolling away, or carried between the palms."""
        assert self._t is not None
        dt = now - self._t
        if dt <= 0.0:
            return
        self._t = now
        q = np.zeros(6)
        q[:3] += REST[0] * dt
        q[3:] += REST[1] * dt
        if len(self._poses) > 1:
            way = np.abs(self._poses[-1][1] - self._poses[-2][1])
            q[:3] += DRIFT[0] * math.hypot(way[0], way[1])
            q[5] += DRIFT[1] * way[2]
        if lost:
            q[:3] += LOST[0] * dt
            q[5] += LOST[1] * dt
        if now < self._moving_until:
            left = (self._moving_until - now) / SETTLES
            q[:3] += LOOSE[0] * left * left * dt * 0.04
            q[3:] += LOOSE[1] * left * left * dt * 0.04
        grip = touch.grip if touch is not None else None
        if grip is not None and self._grip is not None:
            turn = grip[1] @ self._grip[1].T
            before = self._p
            self._p = grip[0] + turn @ (self._p - self._grip[0])
            if touch is not None and not touch.lifted:
                self._p[2] = before[2]  # the table holds it
            self._R = turn @ self._R
            q[:3] += (SLIPS * (self._p - before)) ** 2
            q[3:] += (SLIPS * Rotation.from_matrix(turn, assume_valid=True).as_rotvec()) ** 2
        self._grip = grip
        self._P[range(6), range(6)] += q

    def _age_error(self, t: float) -> None:
        """Let the camera's error grow old to the instant of a picture."""
        if self._error_t is not None and self._correlation > 0.0:
            keep = math.exp(-max(t - self._error_t, 0.0) / self._correlation)
        else:
            keep = 0.0 if self._error_t is not None else 1.0
        self._error_t = t
        self._e *= keep
        self._P[_E] *= keep
        self._P[:, _E] *= keep
        self._P[range(6, 12), range(6, 12)] += 1.0 - keep * keep

    # --- measurements -----------------------------------------------------------------------

    def _see(self, seen: Vision) -> None:
        """A picture, taken a while ago: of a box that has not moved relative to O since."""
        pose = self._pose_at(seen.t)
        if pose is None:
            self.refused += 1
            return
        c, s = math.cos(pose[2]), math.sin(pose[2])
        R_BO = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        p_OB = np.array([pose[0], pose[1], 0.0])
        deviation = SPOILT * np.sqrt(np.diag(seen.covariance))
        if self.taken == 0:
            self._p, self._R = p_OB + R_BO.T @ seen.p, R_BO.T @ seen.R
        self._age_error(seen.t)
        H = np.zeros((6, 12))
        H[:3, _P] = R_BO
        H[3:, _R] = R_BO
        H[:, _E] = np.diag(deviation)
        turn = Rotation.from_matrix(seen.R @ (R_BO @ self._R).T).as_rotvec()
        z = np.concatenate([seen.p - R_BO @ (self._p - p_OB), turn]) - deviation * self._e
        noise = np.diag(PICTURE**2)
        S = H @ self._P @ H.T + noise
        if self.taken and float(z @ np.linalg.solve(S, z)) > GATE:
            self._doubted += 1
            if self._doubted < BELIEVED:
                self.refused += 1
                return
            self._P[range(6), range(6)] += np.array([0.01] * 3 + [0.09] * 3)
            self._moving_until = seen.t + SETTLES
        self._doubted = 0
        self.taken += 1
        self._seen = seen.t
        self._update(H, z, noise)

    def _feel(self, touch: Touch) -> None:
        """Palms on the box: where its faces are along their normals, and which way they look."""
        first, second = touch.points
        if first is None or second is None:
            return
        n, side = self._between(first - second)
        H = np.zeros((1, 12))
        H[0, _P] = n
        z = np.array([n @ (0.5 * (first + second) - self._p)])
        self._update(H, z, np.array([[touch.sd**2]]))
        if touch.normal is not None:
            H = np.zeros((2, 12))
            H[0, _R] = -self._R[:, 2]
            H[1, _R] = side
            z = np.array([side @ touch.normal, self._R[:, 2] @ touch.normal])
            if float(z @ z) < 0.25:
                self._update(H, z, np.eye(2) * touch.normal_sd**2)

    def _between(self, across: Array) -> tuple[Array, Array]:
        """Normal of the face that looks most along ``across``, and the axis a quarter behind it."""
        x, y = self._R[:, 0], self._R[:, 1]
        faces = ((y, x), (-x, y), (-y, -x), (x, -y))
        return max(faces, key=lambda face: float(face[0] @ across))

    def _update(self, H: Array, z: Array, noise: Array) -> None:
        P = self._P
        K = np.linalg.solve(H @ P @ H.T + noise, H @ P).T
        dx = K @ z
        A = np.eye(12) - K @ H
        self._P = A @ P @ A.T + K @ noise @ K.T
        self._p = self._p + dx[_P]
        self._R = Rotation.from_rotvec(dx[_R]).as_matrix() @ self._R
        self._e = self._e + dx[_E]

    def _pose_at(self, t: float) -> Array | None:
        """X_OB then; None if that is too long ago."""
        poses = self._poses
        i = bisect_left(poses, t, key=_first)
        if i == 0:
            return poses[0][1] if t > poses[0][0] - 0.01 else None
        if i == len(poses):
            return poses[-1][1]
        (t0, a), (t1, b) = poses[i - 1], poses[i]
        return a + (b - a) * ((t - t0) / (t1 - t0))


def _first(pair: tuple[float, Array]) -> float:
    return pair[0]
