"""Figures and picture of a run in which two palms lift a box, from its messages."""

from __future__ import annotations

import math
from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from arm.grasping.regions import Edges
from services.logs.runlog import RunLog
from services.topics import ARM_STATUS, TRUTH

Array = NDArray[np.float64]

PALMS = ("left_palm", "right_palm")
LIFTED = 0.15
"""Above where it stood a box is lifted [m]."""
LIMIT = 100.0
"""Force that a palm is stated to stand [N]."""
HOLDS = ("Lift", "Hold", "Lifted")
"""Nodes entered from inside the goal region of the compliance."""


@dataclass(frozen=True)
class Palmed:
    """The truth of a grasp, n samples.

    Attributes:
        t: shape (n,) [s].
        height: of the box above where it stood, shape (n,) [m], and its ``tilt`` (n,) [rad].
        force: on each palm, left then right, shape (n, 2) [N].
        line: of each palm from the line through the box, shape (n, 2) [m].
        distance: of the box from the middle of the platform over the floor, shape (n,) [m].
    """

    t: Array
    height: Array
    tilt: Array
    force: Array
    line: Array
    distance: Array


def palmed(log: RunLog) -> Palmed | None:
    """What palms and box did; None where there are none."""
    truth = [m for m in log.series(TRUTH) if "box" in m.bodies and PALMS[0] in m.bodies]
    if len(truth) < 2:
        return None
    box = np.array([m.bodies["box"] for m in truth])
    R = Rotation.from_quat(box[:, 3:], scalar_first=True).as_matrix()
    off = [np.array([m.bodies[name][:3] for m in truth]) - box[:, :3] for name in PALMS]
    own = [np.einsum("nji,nj->ni", R, o) for o in off]
    pose = np.array([m.pose for m in truth])
    return Palmed(
        t=np.array([m.t for m in truth]),
        height=box[:, 2] - box[0, 2],
        tilt=np.arccos(np.clip(R[:, 2, 2], -1.0, 1.0)),
        force=np.array([[math.hypot(*m.forces[name]) for name in PALMS] for m in truth]),
        line=np.column_stack([np.hypot(o[:, 0], o[:, 2]) for o in own]),
        distance=np.hypot(*(box[:, :2] - pose[:, :2]).T),
    )


def grasp_figures(log: RunLog) -> dict[str, float | bool | None]:
    """Whether the box is up at the end, how far [mm], its largest tilt off the table [deg] and the
    largest force on a palm [N]; nothing where no palms are."""
    seen = palmed(log)
    if seen is None:
        return {}
    up = seen.height > 0.005
    last = log.series(ARM_STATUS)[-1:]
    return {
        "lifted": bool(seen.height[-1] > LIFTED and any(s.node in HOLDS for s in last)),
        "box_height_mm": 1e3 * float(seen.height[-1]),
        "box_tilt_deg": math.degrees(float(seen.tilt[up].max())) if up.any() else None,
        "palm_force_peak_n": float(seen.force.max()),
    }


def grasp(log: RunLog, title: str) -> Figure | None:
    """Palms, forces, box and goal regions over time; None where no palms are."""
    seen = palmed(log)
    if seen is None:
        return None
    edges = Edges()
    figure, axes = plt.subplots(
        4, 1, figsize=(11, 9), sharex=True, height_ratios=(2, 2, 2, 1.5), layout="constrained"
    )
    bars, line, force, height = axes
    _regions(bars, log, seen, edges)
    for i, (name, colour) in enumerate(zip(("left", "right"), ("#1f4e9c", "#e08a1e"), strict=True)):
        line.plot(seen.t, 1e3 * seen.line[:, i], color=colour, lw=1.2, label=f"{name} palm")
        force.plot(seen.t, seen.force[:, i], color=colour, lw=1.0, label=f"{name} palm")
    line.axhline(1e3 * edges.line[0], color="0.4", ls="--", lw=0.8, label="goal region")
    line.set(yscale="log", ylim=(1.0, None), ylabel="from the line [mm]")
    force.axhline(edges.force[0], color="0.4", ls="--", lw=0.8, label="goal region")
    force.axhline(LIMIT, color="#b3261e", ls=":", lw=1.0, label="stated limit")
    force.set(ylabel="force [N]")
    height.plot(seen.t, 1e3 * seen.height, color="#1b7f3b")
    height.set(ylabel="box up by [mm]", xlabel="t [s]")
    for axis in (line, force):
        axis.legend(loc="center right", fontsize=8)
    # the drive is in the picture of the floor
    near = seen.distance < edges.distance[1]
    since = float(seen.t[int(np.argmax(near))]) - 1.0 if near.any() else 0.0
    height.set_xlim(max(since, 0.0), float(seen.t[-1]))
    figure.suptitle(title)
    return figure


def _regions(axis: plt.Axes, log: RunLog, seen: Palmed, edges: Edges) -> None:
    """Bars while the truth is inside each region, each part of the one before; nodes above them."""
    status = log.series(ARM_STATUS)
    names, times = [s.node for s in status], np.array([s.t for s in status])
    at = np.searchsorted(times, seen.t, side="right") - 1
    held = np.array([i >= 0 and names[i] in HOLDS for i in at])
    approach = (seen.distance < edges.distance[1]) | held
    reach = approach & ((seen.line.max(axis=1) < edges.line[1]) | held)
    contact = reach & (seen.force.min(axis=1) > edges.force[1])
    inside = {"approach": approach, "reach": reach, "contact": contact, "comply": contact & held}
    for row, (name, where) in enumerate(inside.items()):
        axis.fill_between(seen.t, row - 0.35, row + 0.35, where=where.tolist(), label=name, lw=0)
    axis.set_yticks(range(len(inside)), list(inside))
    axis.set(ylim=(-0.6, 9.0))
    before, free = "", -math.inf
    for t, node in zip(times, names, strict=True):
        if node and node != before:
            axis.axvline(t, color="0.7", lw=0.6)
            if t - free > 0.15:
                axis.text(t, 3.6, node, fontsize=7, rotation=60, va="bottom", clip_on=True)
                free = t
        before = node
