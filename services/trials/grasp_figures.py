"""Figures of one trial of the grasp, from what it recorded."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from services.messages import ObjectEstimate, Truth
from services.trials.grasp_run import PALMS, Recorded, from_line, least_force, turned

Array = NDArray[np.float64]

TABLE = 0.6
"""A box whose middle is below this is off the table [m]."""
LIFTED = 0.15
"""Above where it stood a box is lifted [m]."""
ON_LINE = 0.014
"""Both palms this near to the line through the box are on it [m]."""
TOUCHES = 2.0
"""Force from which a palm touches [N]."""
SMOOTH = 25
"""Samples of 8 ms over which the palms' paths are smoothed for their jerk."""
STAGES = {
    "start": ("Towards", "Reach", "Parallel"),
    "region": ("Close",),
    "front": ("Reach", "Parallel"),
    "reach": ("Guarded_move",),
    "touch": ("Comply",),
    "comply": ("Lift",),
}
"""Nodes whose first entry is a stage of Fig 7; a variant in which none occurs, or none later than
the stage before, has no such stage."""


def figures(log: Recorded) -> dict[str, Any]:
    """Plain data by name: outcome, times, smoothness, what the box did, estimates by stage."""
    truth = log.truth
    box = np.array([m.bodies["box"][:3] for m in truth])
    forces = np.array([[math.hypot(*m.forces[n]) for n in PALMS] for m in truth])
    last = log.status[-1]
    entered = entries(log)
    first = min((entered[n] for n in ("Reach", "Parallel") if n in entered), default=None)
    comply = entered.get("Lift")
    t = np.array([m.t for m in truth])
    up = box[:, 2] - box[0, 2]
    held = last.node in ("Hold", "Lifted") and bool(up[-1] > LIFTED)
    out: dict[str, Any] = {
        "success": held,
        "end": last.node if last.state in ("running", "finished") else last.state,
        "reason": last.reason,
        "simulated_s": float(t[-1]),
        "off_table": bool((box[:, 2] < TABLE).any()),
        "pushed_s": log.pushed,
        "peak_force_n": float(forces.max()),
        "peak_force_undisturbed_n": float(forces[t < (log.pushed or math.inf)].max()),
        "fell_back": len([1 for a, b in _steps(log) if b in FALLS]),
        "nees": nees(log),
    }
    # from the entry of the first controller to that of the lift, settling included
    out["grasp_s"] = None if first is None or comply is None else comply - first
    out["start_s"] = first
    out["moments"] = moments(truth, first, comply)
    out["jerk_rms"] = None
    if first is not None and comply is not None:
        out["jerk_rms"] = jerk(truth, first, comply)
    out |= carried(truth, comply, held)
    out["stages"], seen = {}, -math.inf
    for name, nodes in STAGES.items():
        begun = min((entered[n] for n in nodes if n in entered), default=-math.inf)
        at = stage(log, begun) if begun > seen else None
        if at is not None:
            out["stages"][name], seen = at, begun
    out["paths"] = paths(truth)
    return out


FALLS = ("Let_go", "Look_again")


def _steps(log: Recorded) -> list[tuple[str, str]]:
    nodes = [m.node for m in log.status if m.node]
    return [(a, b) for a, b in pairwise(nodes) if a != b]


def entries(log: Recorded) -> dict[str, float]:
    """When each node was first entered [s]; of ``Lift`` the last time."""
    out: dict[str, float] = {}
    before = ""
    for m in log.status:
        if m.node != before and m.node and (m.node not in out or m.node == "Lift"):
            out[m.node] = m.t
        before = m.node
    return out


def moments(truth: list[Truth], first: float | None, last: float | None) -> list[float]:
    """Start, both palms first on the line, both touching, lift [s]; of what is not run as three
    nodes as well, so told by the truth; none without a lift."""
    if first is None or last is None:
        return []
    mine = [m for m in truth if first <= m.t <= last]
    reached = next((m.t for m in mine if from_line(m) < ON_LINE), last)
    touched = next((m.t for m in mine if m.t >= reached and least_force(m) > TOUCHES), last)
    return [first, reached, touched, last]


def jerk(truth: list[Truth], first: float, last: float) -> float:
    """Of both palms' middles between two instants, rms over time and palms [m/s^3].

    Third derivative of a quartic fitted to the true path over 0.2 s, as a hand is seen. The path
    before and after belongs to the fit: one cut off at the instants would be extrapolated there.
    """
    t = np.array([m.t for m in truth])
    mine = (first <= t) & (t <= last)
    if len(t) <= SMOOTH or not mine.any():
        return 0.0
    p = np.array([[m.bodies[n][:3] for n in PALMS] for m in truth])
    third = savgol_filter(p, SMOOTH, 4, deriv=3, delta=float(np.mean(np.diff(t))), axis=0)
    return float(np.sqrt(np.mean(np.sum(third[mine] ** 2, axis=2))))


def carried(truth: list[Truth], since: float | None, held: bool) -> dict[str, float | None]:
    """Tilt and slip of the box from the beginning of the lift on: largest [deg], [mm]; tilt at the
    end [deg]."""
    if since is None or not held:
        return {"tilt_deg": None, "tilt_end_deg": None, "slip_mm": None}
    mine = [m for m in truth if m.t >= since]
    tilts = [
        math.degrees(math.acos(min(1.0, max(-1.0, turned(m.bodies["box"])[2, 2])))) for m in mine
    ]
    at = [_in_palm(m) for m in mine if m.t >= since + 0.2]
    slip = max((float(np.linalg.norm(p - at[0])) for p in at), default=0.0)
    return {"tilt_deg": max(tilts), "tilt_end_deg": tilts[-1], "slip_mm": 1000.0 * slip}


def _in_palm(m: Truth) -> Array:
    """The box as both palms see it, mean over them [m]."""
    box = np.array(m.bodies["box"][:3])
    seen = [turned(m.bodies[n]).T @ (box - np.array(m.bodies[n][:3])) for n in PALMS]
    return np.asarray(np.mean(seen, axis=0))


def stage(log: Recorded, t: float) -> list[float] | None:
    """Error of the estimate there, x, y of the box [mm], yaw [mrad], and its stated deviation."""
    at = [m for m in log.box if m.t <= t + 1e-9]
    if not at:
        return None
    found = error(log, at[-1])
    if found is None:
        return None
    e, P = found
    sd = np.sqrt(np.diag(P))[[0, 1, 5]]
    return [float(v) for v in (*(1000.0 * e[[0, 1, 5]]), *(1000.0 * sd))]


def error(log: Recorded, seen: ObjectEstimate) -> tuple[Array, Array] | None:
    """Of the box relative to the platform, along its true axes [m, rad] (6,), and as stated (6, 6).

    Both are relative to the platform, where each of truth and estimate takes it to be.
    """
    pose = log.poses.get(round(seen.t * 1000))
    truth = _at(log.truth, seen.t)
    if pose is None or truth is None:
        return None
    R_WB, R_OB = _about(float(truth.pose[2])), _about(float(pose[2]))
    p_WB = np.array([truth.pose[0], truth.pose[1], 0.0])
    p_OB = np.array([pose[0], pose[1], 0.0])
    R_WX = turned(truth.bodies["box"])
    p = R_WB.T @ (np.array(truth.bodies["box"][:3]) - p_WB) - R_OB.T @ (seen.p - p_OB)
    R_BX = R_WB.T @ R_WX
    turn = Rotation.from_matrix(R_BX @ (R_OB.T @ seen.R).T).as_rotvec()
    e = np.concatenate([R_BX.T @ p, R_BX.T @ turn])
    A = np.kron(np.eye(2), R_BX.T @ R_OB.T)
    return e, A @ seen.covariance @ A.T


def nees(log: Recorded) -> float | None:
    """Normalised squared error of the estimate, mean over the trial, six degrees of freedom."""
    values = []
    for seen in log.box[60::60]:
        found = error(log, seen)
        if found is not None:
            e, P = found
            values.append(float(e @ np.linalg.solve(P, e)))
    return float(np.mean(values)) if values else None


def paths(truth: list[Truth]) -> dict[str, list[list[float]]]:
    """Platform and palms over the floor, relative to where the box stood, at 25 Hz [m]."""
    x, y, _ = truth[0].bodies["box"][:3]
    thin = truth[::5]
    out = {"base": [[round(m.pose[0] - x, 3), round(m.pose[1] - y, 3)] for m in thin]}
    for name in PALMS:
        out[name] = [
            [round(m.bodies[name][0] - x, 4), round(m.bodies[name][1] - y, 4), *_fingers(m, name)]
            for m in thin
        ]
    out["t"] = [[round(m.t, 3)] for m in thin]
    return out


def _fingers(m: Truth, name: str) -> list[float]:
    """Which way the fingers point, over the floor."""
    z = turned(m.bodies[name])[:, 2]
    return [round(-float(z[0]), 3), round(-float(z[1]), 3)]


def _at(truth: list[Truth], t: float) -> Truth | None:
    i = round((t - truth[0].t) / 0.008)
    near = truth[max(i - 1, 0) : i + 2]
    best = min(near, key=lambda m: abs(m.t - t), default=None)
    return best if best is not None and abs(best.t - t) < 0.0045 else None


def _about(yaw: float) -> Array:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
