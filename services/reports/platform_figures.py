"""Figures of how the platform drove, from a run's messages."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from deploy.task import BaseTask
from services.logs.runlog import RunLog
from services.messages import BASE_ENDED
from services.reports.curves import HOLE
from services.topics import BASE_COMMAND, BASE_STATUS, TRUTH

Array = NDArray[np.float64]

PLATFORM_FIGURES = (
    "platform_way_m",
    "platform_time_s",
    "platform_clearance_mm",
    "platform_goal_mm",
    "platform_goal_deg",
    "platform_speed",
    "platform_acceleration",
    "platform_jerk",
    "platform_stops",
    "platform_blocked_s",
)
HELD = ("blocked", "stopped", "blind", "waiting_for_arm")
"""States of the platform in which it stands although it has something to do."""
NO_OBSTACLE = 900.0
"""A clearance above this says that nothing is there [m]."""
STEP = 0.02
"""The way is measured between instants this far apart: the floor's shaking is no way [s]."""


def platform_figures(log: RunLog, task: BaseTask) -> dict[str, float | None]:
    """How the platform did its task; all None where it had none and stood.

    Way [m], clearance [mm] and distance to the goal [mm, deg] are the truth's. Speed [m/s],
    acceleration [m/s^2] and jerk [m/s^3] are those of the commands, the larger of vx and vy, as
    their limits are. Time counts from ``start_at`` until the task is over, None if it never is.
    Stops are those on the way: the platform moved before and after.

    Args:
        log: of a run.
        task: what the platform was told.
    """
    out: dict[str, float | None] = dict.fromkeys(PLATFORM_FIGURES)
    truth, commands = log.series(TRUTH), log.series(BASE_COMMAND)
    moved = any(np.any(c.velocity) for c in commands)
    if len(truth) < 2 or not commands or not (moved or task.behaviour != "hold_still"):
        return out
    pose = np.array([x.pose for x in truth])
    stamps = np.array([x.t for x in truth])
    apart = max(1, round(STEP / max(stamps[1] - stamps[0], 1e-9)))
    steps = np.hypot(*np.diff(pose[::apart, :2], axis=0).T)
    out["platform_way_m"] = float(steps[np.diff(stamps[::apart]) <= HOLE].sum())
    clearance = min(x.clearance for x in truth)
    if clearance < NO_OBSTACLE:
        out["platform_clearance_mm"] = 1e3 * clearance
    if task.goal is not None:
        off = np.array(task.goal) - pose[-1]
        out["platform_goal_mm"] = 1e3 * float(np.hypot(off[0], off[1]))
        out["platform_goal_deg"] = abs(float(np.degrees(np.angle(np.exp(1j * off[2])))))
    t = np.array([c.t for c in commands])
    velocity = np.array([c.velocity[:2] for c in commands])
    for name, values in zip(("speed", "acceleration", "jerk"), _rates(t, velocity), strict=True):
        out[f"platform_{name}"] = float(np.abs(values).max()) if len(values) else None
    return out | _times(log, task.start_at)


def _rates(t: Array, velocity: Array) -> tuple[Array, Array, Array]:
    """Commands (n, 2) and their first and second differences over time."""
    # a command that follows early is no larger step in the drive's period
    dt = np.maximum(np.diff(t), 1.0 / BASE_COMMAND.rate)[:, None]
    acceleration = np.diff(velocity, axis=0) / dt
    jerk = np.diff(acceleration, axis=0) / dt[1:]
    return velocity, acceleration, jerk


def _times(log: RunLog, start: float) -> dict[str, float | None]:
    """Time until the task was over, stops before that, and how long it was held up."""
    statuses = log.series(BASE_STATUS)
    end = next((s.t for s in statuses if s.state in BASE_ENDED and s.t >= start), None)
    under_way = [s for s in statuses if s.t >= start and (end is None or s.t <= end)]
    moving = [bool(np.any(s.chosen)) for s in under_way]
    starts = sum(b and not a for a, b in itertools.pairwise([False, *moving]))
    held = 0.0 + sum(b.t - a.t for a, b in itertools.pairwise(under_way) if a.state in HELD)
    return {
        "platform_time_s": None if end is None else end - start,
        "platform_stops": float(max(starts - 1, 0)),
        "platform_blocked_s": held,
    }
