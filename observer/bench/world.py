"""A small seeded planar world: true motion on a 1 ms grid and the messages it gives rise to.

Independent of the observer: the truth is integrated by plain small steps, so a fault in the closed
forms of the observer's model cannot hide here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import lfilter

from deploy.robot import MobileBase, load_robot
from observer.bench.conditions import Conditions, described, truly
from observer.bench.manoeuvres import Manoeuvre
from observer.bench.sensing import Motion, Report, reports
from services.messages import Array

DT = 0.001
"""Step of the truth [s]."""
COMMANDS = 50
"""Steps between two commands; a command acts one step after its stamp."""
ROBOT: MobileBase = load_robot("xr4000_puma560")
PUSH = 200.0 / 190.0
"""Acceleration of a push: 200 N on 190 kg [m/s^2] ..."""
PUSH_TIME = 0.2
"""... for so long [s]."""
BRAKES = 0.03
"""Time constant with which the brakes bring the platform to rest [s]."""
SLIP = (0.5, 3.0)
"""So long before and after a slip begins nobody is judged [s]: which O is meant is an open
question, and a smoother sees it coming."""


@dataclass(frozen=True)
class World:
    """Truth and messages of one run.

    Attributes:
        t: instants, ``DT`` apart, (n,) [s].
        pose: X_OB [m, m, rad], heading continuous, (n, 3).
        velocity: V_OB_O [m/s, m/s, rad/s], (n, 3).
        acceleration: A_OB_O [m/s^2, m/s^2, rad/s^2], (n, 3).
        reference: what an estimate is compared with, (n, 3): ``pose``, shifted by what the wheels
            have slipped until then, because odometry takes its frame O along.
        arrivals: (arrival time [s], message), ordered.
        robot: what the observer is told of the robot.
        truth: what the robot truly is: lag, noise of the IMU, scale, mounting, dead time.
        conditions: what this world was made with.
    """

    t: Array
    pose: Array
    velocity: Array
    acceleration: Array
    reference: Array
    arrivals: list[tuple[float, Report]]
    robot: MobileBase
    truth: MobileBase
    conditions: Conditions

    def judged(self, start: float) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Mask (n,) of the instants from ``start`` [s] on that are not around a slip."""
        keep = self.t >= start
        for slip in self.conditions.slips:
            keep &= ~((self.t >= slip[0] - SLIP[0]) & (self.t < slip[0] + SLIP[1]))
        return keep


def simulate(
    command: Manoeuvre,
    seed: int,
    duration: float = 20.0,
    *,
    robot: MobileBase = ROBOT,
    **conditions: Any,
) -> World:
    """Simulate a platform and its sensors.

    Args:
        command: V_OB_B by time, sent at 20 Hz and acting 1 ms later.
        seed: of everything random.
        duration: [s].
        robot: what the robot is said to be.
        conditions: fields of `Conditions`.

    Raises:
        TypeError: a condition that does not exist.
    """
    how = Conditions(**conditions)
    rng = np.random.default_rng(seed)
    n = round(duration / DT) + 1
    told = described(robot, how)
    truth = truly(told, how, rng)
    t = np.arange(n, dtype=np.float64) * np.float64(DT)
    push_and_noise = _disturbance(truth, how, t, rng)
    start = rng.uniform((-1.0, -1.0, -math.pi), (1.0, 1.0, math.pi))
    if how.heading is not None:
        start[2] = how.heading
    sent, u = _commands(command, n, round(how.command_delay / DT))
    v, rate = _velocity(truth, how, u, push_and_noise)
    motion = Motion(t, DT * 0.5 * (v[:-1] + v[1:]), v[:-1], rate, start)
    pose = motion.path()
    c, s, w = np.cos(pose[:, 2]), np.sin(pose[:, 2]), v[:-1, 2]
    ax, ay = rate[:, 0] - w * v[:-1, 1], rate[:, 1] + w * v[:-1, 0]
    return World(
        t=t,
        pose=pose,
        velocity=np.stack([c * v[:-1, 0] - s * v[:-1, 1], s * v[:-1, 0] + c * v[:-1, 1], w], 1),
        acceleration=np.stack([c * ax - s * ay, s * ax + c * ay, rate[:, 2]], 1),
        reference=pose + how.slipped(t),
        arrivals=reports(motion, pose, sent, told, truth, how, rng),
        robot=told,
        truth=truth,
        conditions=how,
    )


def _disturbance(truth: MobileBase, how: Conditions, t: Array, rng: np.random.Generator) -> Array:
    """Acceleration in B that no command explains, (n, 3)."""
    deviation = np.array(truth.platform.disturbance)
    keep = math.exp(-DT / truth.platform.disturbance_time)
    kicks = rng.standard_normal((len(t), 3)) * deviation * math.sqrt(1.0 - keep**2)
    first = rng.standard_normal((1, 3)) * deviation
    out: Array = lfilter([1.0], [1.0, -keep], np.concatenate([first, kicks[:-1]]), axis=0)
    directions = rng.uniform(-math.pi, math.pi, len(how.pushes))
    for start, angle in zip(how.pushes, directions, strict=True):
        during = (t >= start) & (t < start + PUSH_TIME)
        out[during, :2] += PUSH * np.array([math.cos(angle), math.sin(angle)])
    return out


def _commands(command: Manoeuvre, n: int, delay: int) -> tuple[Array, Array]:
    """Commands as sent, one row each ``COMMANDS`` steps, and as the drive acts on them (n, 3)."""
    sent = np.array([command(k * DT) for k in range(0, n, COMMANDS)])
    acting = (np.arange(n) - 1 - delay) // COMMANDS
    return sent, np.where((acting >= 0)[:, None], sent[np.maximum(acting, 0)], 0.0)


def _velocity(truth: MobileBase, how: Conditions, u: Array, d: Array) -> tuple[Array, Array]:
    """Velocity in B (n + 1, 3) and its derivative (n, 3), by Euler steps."""
    n = len(u)
    v, rate = np.zeros((n + 1, 3)), np.zeros((n, 3))
    if how.stuck:
        return v, rate
    lag = truth.platform.lag
    idle, held = 0, []
    for standing in (u == 0.0).all(axis=1).tolist():
        idle = idle + 1 if standing else 0
        held.append(idle * DT > how.brakes)
    for axis, limit in enumerate(truth.platform.acceleration_limit):
        speed, speeds, rates = 0.0, [0.0], []
        for want, push, brake in zip(u[:, axis].tolist(), d[:, axis].tolist(), held, strict=True):
            drive = min(max((want - speed) / lag, -limit), limit) + push
            r = -speed / BRAKES if brake else drive
            speed += r * DT
            speeds.append(speed)
            rates.append(r)
        v[:, axis], rate[:, axis] = speeds, rates
    return v, rate
