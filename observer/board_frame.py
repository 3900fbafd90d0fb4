"""Where the board is in odometry's frame: its slow drift, seen by vision, given out without steps.

Odometry's frame O drifts against the ground as the platform drives: by a wheel's wrong scale in
proportion to the way, by slip at random. What stands on the ground drifts in O the same way. The
state is the board's pose in O and the share s of the way that odometry reads too much::

    p_OS' = s v_OB + n_p,   heading' = n_h,   s' = n_s

A sighting at t says X_OB(t) X_BS. Because drift goes with the way, what it says of the present is
known exactly however late it comes: p_OS(now) = p_OS(t) + s (p_OB(now) - p_OB(t)).

Source: any random-walk Kalman filter (Gelb, Applied Optimal Estimation, 1974, ch. 4); the time of
the measurement after Larsen et al. 1998, as in ``delayed_ekf.py``.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from observer.sensor_models import wrap
from services.messages import Array, BoardEstimate, Estimate, Vision


@dataclass(frozen=True)
class BoardOptions:
    """Constants of the filter and of how its news are fed in."""

    placed: tuple[float, float] = (0.003, 0.01)
    """How well the board's place is known at the start [m], [rad]."""
    scale: float = 0.01
    """Standard deviation of s at the start [1]."""
    slip: tuple[float, float] = (0.0005, 0.0005)
    """Drift that the scale does not explain, per root metre driven [m], [rad]."""
    wander: tuple[float, float] = (2e-5, 2e-5)
    """And per root second [m], [rad]."""
    scale_walk: float = 1e-5
    """Of s, per root second [1]."""
    heading: float = 3e-4
    """Of the estimate of the platform, at the stamp of a sighting [rad]."""
    gate: float = 16.3
    """A sighting with more squared deviations than this is refused; 0.1 % of good ones are."""
    patience: int = 15
    """So many refused in a row mean that the platform has slipped: all are believed again, ..."""
    slipped: tuple[float, float] = (0.05, 0.05)
    """... with this added to what is not known [m], [rad]."""
    leaning: float = 1.3
    """A slip too small for the gate: the mean of the last ten or so sightings leans to one side by
    so many deviations of one, ..."""
    recent: float = 0.1
    """... this being the weight of the newest in that mean ..."""
    slid: float = 0.002
    """... and this added to what is not known of the place [m]."""
    frequency: float = 2.0
    """Of the critically damped law by which the output follows [rad/s]."""
    rate: tuple[float, float] = (0.004, 0.004)
    """Largest velocity of a correction [m/s], [rad/s] ..."""
    acceleration: tuple[float, float] = (0.01, 0.01)
    """... and acceleration [m/s^2], [rad/s^2]."""
    period: float = 0.02
    """Between two messages [s]."""
    history: float = 0.5
    """An older sighting is refused [s]."""
    name: str = "board"
    """Of the object that vision sees."""


class BoardFrame:
    """Fuses sightings of the board with the estimate of the platform.

    Args:
        placed: X_OS as believed at the start: x, y of its origin [m], yaw [rad].
        options: constants.

    Attributes:
        x: what is believed: x, y [m], yaw [rad], s [1].
        P: its covariance, (4, 4).
        taken: sightings used.
        refused: sightings refused.
    """

    def __init__(
        self, placed: tuple[float, float, float], options: BoardOptions | None = None
    ) -> None:
        self.options = o = options or BoardOptions()
        self.x = np.array([*placed, 0.0])
        self.P = np.diag(np.square([o.placed[0], o.placed[0], o.placed[1], o.scale]))
        self.taken = self.refused = 0
        self._in_a_row = 0
        self._lean = np.zeros(2)
        self._times: list[float] = []
        self._poses: list[Array] = []
        self._seen = -math.inf
        self._pose = self.x[:3].copy()
        self._velocity = np.zeros(3)
        self._bent = np.zeros(3)
        self._due: float | None = None

    def step(self, estimate: Estimate, sightings: Iterable[Vision]) -> BoardEstimate | None:
        """Take in the newest estimate of the platform and what was seen.

        Args:
            estimate: X_OB now; one that is not valid is left out.
            sightings: of any object, in any order.

        Returns:
            Where the board is, when that is due and it has been seen once; else None.
        """
        if not estimate.valid:
            return None
        self._drive(estimate)
        for vision in sightings:
            if vision.name == self.options.name:
                self._see(vision)
        if not self.taken or (self._due is not None and estimate.t + 1e-9 < self._due):
            return None
        return self._give(estimate)

    def _drive(self, estimate: Estimate) -> None:
        """Carry the belief along with the platform."""
        o = self.options
        if self._times:
            dt = estimate.t - self._times[-1]
            if dt <= 0.0:
                return
            way = estimate.pose[:2] - self._poses[-1][:2]
            F = np.eye(4)
            F[:2, 3] = way
            self.x = F @ self.x
            driven = math.hypot(*way)
            p, h = (w * w * dt + s * s * driven for w, s in zip(o.wander, o.slip, strict=True))
            self.P = F @ self.P @ F.T + np.diag([p, p, h, o.scale_walk**2 * dt])
        self._times.append(estimate.t)
        self._poses.append(estimate.pose)
        if self._times[0] < estimate.t - 2.0 * o.history:
            kept = bisect_right(self._times, estimate.t - o.history)
            del self._times[:kept], self._poses[:kept]

    def _see(self, vision: Vision) -> None:
        """Fuse one sighting, or refuse it."""
        o = self.options
        pose = self._platform_at(vision.t)
        if pose is None:
            self.refused += 1
            return
        c, s = math.cos(pose[2]), math.sin(pose[2])
        R = np.array([[c, -s], [s, c]])
        arm = R @ vision.p[:2]
        yaw = pose[2] + math.atan2(-vision.R[1, 2], -vision.R[0, 2])
        H = np.eye(3, 4)
        H[:2, 3] = pose[:2] - self._poses[-1][:2]  # less way had been driven then
        z = np.array([*(pose[:2] + arm), yaw])
        y = z - H @ self.x
        y[2] = wrap(float(y[2]))
        turned = np.eye(3)
        turned[:2, :2] = R
        seen = vision.covariance[np.ix_((0, 1, 5), (0, 1, 5))]
        lever = np.array([-arm[1], arm[0], 1.0])  # of an error of the platform's heading
        noise = turned @ seen @ turned.T + o.heading**2 * np.outer(lever, lever)
        S = H @ self.P @ H.T + noise
        if float(y @ np.linalg.solve(S, y)) > o.gate:
            self.refused += 1
            self._in_a_row += 1
            if self._in_a_row < o.patience:
                return
            p, h = o.slipped
            self.P = self.P + np.diag(np.square([p, p, h, 0.0]))
            S = H @ self.P @ H.T + noise
        self._in_a_row = 0
        self._watch_for_slip(y, S)
        S = H @ self.P @ H.T + noise
        K = np.linalg.solve(S, H @ self.P).T
        self.x = self.x + K @ y
        left = np.eye(4) - K @ H
        self.P = left @ self.P @ left.T + K @ noise @ K.T
        self.taken += 1
        self._seen = max(self._seen, vision.t)

    def _watch_for_slip(self, y: Array, S: Array) -> None:
        """A slip leaves the scale as it is; sightings that lean to one side tell of it."""
        o = self.options
        news = y[:2] / np.sqrt(S.diagonal()[:2])
        self._lean = self._lean + o.recent * (news - self._lean)
        if np.abs(self._lean).max() > o.leaning:
            self._lean = np.zeros(2)
            self.P = self.P + np.diag([o.slid**2, o.slid**2, 0.0, 0.0])

    def _platform_at(self, t: float) -> Array | None:
        """X_OB at ``t`` [s] between the estimates kept; None outside of them."""
        i = bisect_right(self._times, t + 1e-9)
        if i == 0 or t > self._times[-1] + 0.01:
            return None
        if i == len(self._times):
            return self._poses[-1]
        a, b = self._times[i - 1], self._times[i]
        x = (t - a) / (b - a)
        return self._poses[i - 1] + x * (self._poses[i] - self._poses[i - 1])

    def _give(self, estimate: Estimate) -> BoardEstimate:
        """The output a period on: where its last velocity took it, and a new velocity."""
        o = self.options
        dt = o.period if self._due is None else estimate.t - self._due + o.period
        if self._due is not None:
            self._pose = self._pose + self._velocity * dt
        self._due = estimate.t + o.period
        error = self.x[:3] - self._pose
        error[2] = wrap(float(error[2]))
        w = o.frequency
        pull = w * w * error - 2.0 * w * self._bent
        self._bent = self._bent + dt * _within(pull, *o.acceleration)
        self._bent = _within(self._bent, *o.rate)
        drift = np.array([*(self.x[3] * estimate.velocity[:2]), 0.0])
        self._velocity = drift + self._bent
        return BoardEstimate(
            t=estimate.t,
            pose=self._pose.copy(),
            velocity=self._velocity.copy(),
            covariance=self.P[:3, :3].copy(),
            wheel_scale=float(1.0 / (1.0 - self.x[3])),
            age=max(estimate.t - self._seen, 0.0),
            taken=self.taken,
            refused=self.refused,
        )


def _within(v: Array, linear: float, angular: float) -> Array:
    """Shorten the first two entries together and the third by itself."""
    size = math.hypot(v[0], v[1])
    scale = min(1.0, linear / size) if size > 0.0 else 1.0
    return np.array([scale * v[0], scale * v[1], min(max(float(v[2]), -angular), angular)])
