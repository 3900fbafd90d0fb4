"""Where to put the palm for a grasp, and joint paths there.

A reach is told by what is roughly known of the object: a point on its axis and the axis. The palm
looks at the point from a direction ``tilt`` away from the axis. Which tilt is left to chance, since
of an object that was never seen nothing better is known; a reach that got stuck is repeated from
near the axis (docs/grasping.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from arm.hand.model import FLEX, JOINTS, SPREAD, HandModel

Array = NDArray[np.float64]

DEPTH = 0.105
"""From palm to where the fingertips meet, at the flexions that hold a hand's width [m]."""
STARTS = 10
ITERATIONS = 60
MARGIN = 0.10
"""Joints are kept this far inside their limits [rad]."""
DAMPING = 1e-4
CLOSE = 1e-4
"""Error of a solution, m and rad alike."""


@dataclass(frozen=True)
class Guess:
    """What is known of the object before it is touched.

    Attributes:
        point: on its axis, where to grasp, in B, shape (3,) [m].
        axis: unit, upwards, shape (3,).
    """

    point: Array
    axis: Array


def look(guess: Guess, tilt: float, azimuth: float, yaw: float) -> tuple[Array, Array]:
    """R_BH and p_BH of a palm that looks at the point.

    Args:
        guess: where to.
        tilt: between where the palm comes from and the axis [rad].
        azimuth: of where it comes from, about the axis, from -x of B [rad].
        yaw: of the hand about its own z [rad].
    """
    about = Rotation.from_rotvec((azimuth + np.pi) * guess.axis)
    from_ = about.apply(np.array([np.sin(tilt), 0.0, np.cos(tilt)]))
    z = -from_
    # x of the hand where the axis appears downwards, before it yaws; finger 0 is at -x
    x = np.cross(about.apply([0.0, 1.0, 0.0]), z)
    R = np.column_stack([x, np.cross(z, x), z]) @ Rotation.from_rotvec([0, 0, yaw]).as_matrix()
    return R, guess.point + DEPTH * from_


def across(guess: Guess, line: Array) -> float:
    """The azimuth from which ``line`` (3,) appears level, of both the one nearer to -x of B."""
    flat = line - guess.axis * (line @ guess.axis)
    angle = float(np.arctan2(flat[1], flat[0])) - 1.5 * np.pi
    return float(np.clip((angle + np.pi / 2) % np.pi - np.pi / 2, -1.4, 1.4))


def solve(
    model: HandModel, R: Array, p: Array, rng: np.random.Generator, near: Array | None = None
) -> Array | None:
    """Arm joints that place the palm at R_BH, p_BH, shape (7,) [rad]; None if none were found.

    Args:
        model: of arm and hand.
        R, p: of the palm.
        rng: for where to start from.
        near: prefer what is close to these joints, shape (7,); else what is far from limits and
            singularities.
    """
    lower, upper = model.lower[:7] + MARGIN, model.upper[:7] - MARGIN
    rest = np.array(model.robot.arm.rest) if near is None else near
    best, best_score = None, -np.inf
    for start in range(STARTS):
        spread = 0.0 if start == 0 else 0.6
        q = np.clip(rest + spread * rng.standard_normal(7), lower, upper)
        q, J, error = _descend(model, q, R, p, lower, upper)
        if error > CLOSE:
            continue
        if near is not None:
            score = -float(np.abs(q - near).max())
        else:
            margin = float(np.minimum(q - lower, upper - q).min())
            score = min(margin, 0.4) + 2.0 * float(np.linalg.svd(J, compute_uv=False)[-1])
        if score > best_score:
            best, best_score = q, score
    return best


def _descend(
    model: HandModel, q: Array, R: Array, p: Array, lower: Array, upper: Array
) -> tuple[Array, Array, float]:
    """Damped Gauss-Newton from q, joints clipped to their limits."""
    full = np.zeros(JOINTS)
    error = np.inf
    J = np.zeros((6, 7))
    for _ in range(ITERATIONS):
        full[:7] = q
        R_now, p_now, J = model.palm_at(full)
        e = np.concatenate([Rotation.from_matrix(R @ R_now.T).as_rotvec(), p - p_now])
        error = float(np.abs(e).max())
        if error < CLOSE:
            break
        e *= min(1.0, 0.5 / max(error, 1e-9))
        q = np.clip(q + J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(6), e), lower, upper)
    return q, J, error


class Path:
    """Joint references along waypoints, each leg with zero speed at its ends.

    Args:
        points: joints, shape (11,) each [rad]; the first is where the hand is.
        speed: largest mean rate of any joint on a leg, of all legs or each [rad/s].
    """

    def __init__(self, points: list[Array], speed: float | list[float] = 0.8) -> None:
        self._points = points
        speeds = speed if isinstance(speed, list) else [speed] * (len(points) - 1)
        self._time = [
            max(0.2, float(np.abs(b - a).max()) / fastest)
            for (a, b), fastest in zip(pairwise(points), speeds, strict=True)
        ]
        self.duration = sum(self._time)

    def begins(self, leg: int) -> float:
        """Time after the start at which a leg begins [s]."""
        return sum(self._time[:leg])

    def at(self, t: float) -> tuple[Array, Array]:
        """References and their rates a time after the start, shape (11,) each."""
        for leg, took in enumerate(self._time):
            if t < took:
                s = max(0.0, t / took)
                way = self._points[leg + 1] - self._points[leg]
                blend = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
                rate = 30.0 * s * s * (1.0 - s) ** 2 / took
                return self._points[leg] + blend * way, rate * way
            t -= took
        return self._points[-1], np.zeros(JOINTS)


def opened(arm: Array, spread: float, flexion: float) -> Array:
    """Driven joints of a hand that is open, shape (11,)."""
    q = np.empty(JOINTS)
    q[:7], q[SPREAD], q[FLEX] = arm, spread, flexion
    return q
