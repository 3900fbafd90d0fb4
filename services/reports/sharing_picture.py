"""Picture of how arm and platform share a way: who is where, what is left, who voted for what."""

from __future__ import annotations

import math
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from services.logs.runlog import RunLog
from services.messages import ArmStatus, BaseStatus, Truth
from services.reports.curves import broken
from services.topics import ARM_STATUS, BASE_STATUS, TRUTH

Array = NDArray[np.float64]

TOOL, PLATFORM, LEFT = "#1f4e9c", "#e08a1e", "#2e7d32"
BEHAVIOUR = "keep_in_reach"
"""A run in which the platform comes along with the arm has votes of this name."""


def sharing(log: RunLog, title: str) -> Figure | None:
    """Tip and platform along the board, away from it, speeds, what the arm has left, votes."""
    truth, arm, base = log.series(TRUTH), log.series(ARM_STATUS), log.series(BASE_STATUS)
    if len(truth) < 2 or not arm or not any(BEHAVIOUR in b.votes for b in base):
        return None
    at_work = [s for s in arm if s.anchored]
    if not at_work:
        return None
    along = np.array([np.sin(at_work[0].facing), -np.cos(at_work[0].facing)])
    figure, axes = plt.subplots(5, 1, figsize=(13, 13), sharex=True, layout="constrained")
    _places(axes[0], axes[1], truth, along)
    _speeds(axes[2], truth, at_work, along)
    _left(axes[3], arm)
    _votes(axes[4], base)
    for axis in axes:
        axis.axvspan(at_work[0].t, at_work[-1].t, color="0.9", lw=0, zorder=0)
        axis.legend(loc="upper right", ncols=3)
    axes[-1].set_xlabel("t [s] (grey: the pen is at work)")
    figure.suptitle(title)
    return figure


def _places(upper: Any, lower: Any, truth: list[Truth], along: Array) -> None:
    pose, tip = np.array([x.pose for x in truth]), np.array([x.tip for x in truth])
    t, pose, tip = broken(np.array([x.t for x in truth]), pose, tip)
    platform = pose[:, :2] @ along
    upper.plot(t, tip[:, 0], color=TOOL, label="pen")
    upper.plot(t, platform, color=PLATFORM, label="platform")
    upper.set_ylabel("along the board [m]")
    back = pose[:, :2] @ np.array([along[1], -along[0]])
    lower.plot(t, 1e3 * (back - back[0]), color=PLATFORM, label="platform, away from the board")
    between = tip[:, 0] - platform
    lower.plot(t, 1e3 * (between - between[0]), color=TOOL, label="pen before the platform")
    lower.set_ylabel("[mm]")


def _speeds(axis: Any, truth: list[Truth], arm: list[ArmStatus], along: Array) -> None:
    velocity = np.array([x.velocity for x in truth])
    t, velocity = broken(np.array([x.t for x in truth]), velocity)
    axis.plot(t, 1e3 * velocity[:, :2] @ along, color=PLATFORM, label="platform, along the board")
    speed = [1e3 * float(np.linalg.norm(s.tool_velocity)) for s in arm]
    axis.plot([s.t for s in arm], speed, color=TOOL, label="pen, along its line")
    axis.set_ylabel("[mm/s]")


def _left(axis: Any, arm: list[ArmStatus]) -> None:
    t = [s.t for s in arm]
    axis.plot(t, [1e3 * s.reach_margin for s in arm], color=LEFT, label="reach left [mm]")
    share = [1e3 * s.joint_margin for s in arm]
    axis.plot(t, share, color=LEFT, ls=":", label="joint range left [mrad]")
    axis.set_ylim(bottom=0.0)


def _votes(axis: Any, base: list[BaseStatus]) -> None:
    t = np.array([b.t for b in base])
    names = sorted({name for b in base for name, v in b.votes.items() if v[3] > 0.0})
    for name in names:
        speed = [
            1e3 * math.hypot(*b.votes[name][:2]) if name in b.votes else math.nan for b in base
        ]
        axis.plot(t, speed, lw=1.0, label=name)
    chosen = [1e3 * float(np.hypot(*b.chosen[:2])) for b in base]
    axis.plot(t, chosen, color="black", lw=1.5, ls="--", label="chosen")
    axis.set_ylabel("votes [mm/s]")
