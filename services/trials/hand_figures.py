"""Figures of a grasp by touch, and the table they make; shared by the grasp experiments."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.hand.grasp import Try
from arm.hand.quality import epsilon
from arm.hand.sliding import PERIOD
from services.trials.hand_run import SLIP, Trial
from services.trials.lines import Line, middle, share, worst

Array = NDArray[np.float64]

SMOOTH = round(0.2 / PERIOD)
"""Updates over which residuals are smoothed before they count as rising."""
RISE = 0.03
PEAK = 80.0
"""What a fingertip of this hand survives [N]."""
FORCE = 0.5
"""Deviation of a fingertip's force from its set point that is still good [N]."""


def figures(trial: Trial) -> dict[str, Any]:
    """Plain data by name of one trial."""
    grasp, felt = trial.grasp, trial.felt
    last, pair = grasp.tries[-1], grasp.plan.way.pair
    converged = last.end == "converged"
    force = np.abs(np.array(felt.force)).reshape(-1, 3)
    normal = np.array([v for row in felt.normal for v in row])
    row: dict[str, Any] = {
        "outcome": grasp.outcome,
        "converged": converged,
        "success": converged if grasp.plan.lift <= 0.0 else grasp.outcome == "held",
        "tries": len(grasp.tries),
        "ends": [t.end for t in grasp.tries],
        "updates": last.updates if converged else None,
        "off": felt.off / felt.samples if felt.samples else None,
        "released": felt.released / felt.samples if felt.samples else None,
        "force_rms": float(np.sqrt(np.mean(force**2))) if len(force) else None,
        "force_far": float(np.mean(force > FORCE)) if len(force) else None,
        "normal_rms": float(np.sqrt(np.mean(normal**2))) if len(normal) else None,
        "peak_n": felt.peak,
        "knock_n": felt.knock,
        "moved_m": trial.moved,
        "tilted": trial.tilted,
        "lifted_m": trial.lifted,
        "shake_m": trial.shake,
        "push_m": trial.push,
        "simulated_s": trial.simulated,
        "curves": [curve(t) for t in grasp.tries if t.history],
    }
    first = next((t for t in grasp.tries if t.first is not None), None)
    up = np.array([0.0, 0.0, 1.0])
    row["angle_before"] = angle(first.first[1], up, pair) if first and first.first else None
    row["angle_after"] = angle(last.points, trial.axis, pair) if converged else None
    row["rho"] = list(_ends(last, 0)) if converged else None
    row["moment"] = list(_ends(last, 1)) if converged else None
    row["rise"] = rise([r for r, _ in last.history]) if converged else None
    for name, friction in (("eps_03", 0.3), ("eps_05", 0.5)):
        row[name] = None
        if converged and last.normals is not None and last.points is not None:
            row[name] = epsilon(last.normals, last.points, friction, grasp.plan.way.radius)
    return row


def _ends(mine: Try, which: int) -> tuple[float, float]:
    return mine.history[0][which], mine.history[-1][which]


def curve(mine: Try) -> dict[str, Any]:
    """Residuals of a try by update, and how it ended."""
    kept = mine.history[:400]
    return {
        "end": mine.end,
        "rho": [round(r, 4) for r, _ in kept],
        "moment": [round(m, 4) for _, m in kept],
    }


def angle(points: Array | None, axis: Array, pair: bool) -> float | None:
    """Between axis and line of the (virtual) pair, or plane normal of three, in [0, pi/2] [rad]."""
    if points is None:
        return None
    if pair:
        line = 0.5 * (points[1] + points[2]) - points[0]
    else:
        line = np.cross(points[1] - points[0], points[2] - points[0])
    cosine = abs(float(line @ axis)) / max(float(np.linalg.norm(line)), 1e-12)
    return math.acos(min(1.0, cosine))


def rise(values: list[float]) -> float:
    """By how much a residual, smoothed over 0.2 s, rises above its least so far."""
    v = np.array(values)
    if len(v) < SMOOTH + 1:
        return 0.0
    smooth = np.convolve(v, np.ones(SMOOTH) / SMOOTH, mode="valid")
    return float(np.max(smooth - np.minimum.accumulate(smooth)))


def lines(rows: list[dict[str, Any]], goal: float, updates: float = 40.0) -> list[Line]:
    """The table: how often it found a grasp, how fast, how good, how well it held.

    Args:
        rows: of the trials.
        goal: for the share of grasps found.
        updates: goal for the median of updates to convergence.
    """
    found = [row for row in rows if row["converged"]]
    held = [row for row in rows if row["shake_m"]]
    stuck = [row for row in rows if row["ends"][0] != "converged"]
    out = [
        share("grasp found", (row["converged"] for row in rows), goal=goal),
        share("grasp found at the first reach", (row["tries"] == 1 for row in found)),
        share("found by reaching again, of those that had to", _again(stuck), goal=0.9),
        *(
            share(f"... where {end!r} ended the first", _again(rest))
            for end, rest in _ends_of(stuck)
        ),
        middle("updates to convergence", (row["updates"] for row in found), goal=updates),
        middle("orientation before [rad]", (row["angle_before"] for row in rows)),
        middle("orientation after [rad]", (row["angle_after"] for row in found)),
        middle("|rho| before", (row["rho"][0] for row in found)),
        middle("|rho| after", (row["rho"][1] for row in found)),
        middle("|M|/r_c after", (row["moment"][1] for row in found)),
        share("force residual monotone within 0.03", (row["rise"] <= RISE for row in found), 0.98),
        share("force closure at friction 0.3", (row["eps_03"] > 0.0 for row in found)),
        middle("epsilon at friction 0.3", (row["eps_03"] for row in found)),
        middle("epsilon at friction 0.5", (row["eps_05"] for row in found)),
        share("contact kept in 99.5 % of steps", (row["off"] <= 0.005 for row in found), 0.95),
        share("... of steps of the physics", (row["released"] <= 0.005 for row in found)),
        middle("steps of the physics without contact", (row["released"] for row in found)),
        share("force within 0.5 N in 99 %", (row["force_far"] <= 0.01 for row in found)),
        middle("force error, rms [N]", (row["force_rms"] for row in found)),
        middle("normal error, rms [rad]", (row["normal_rms"] for row in found), goal=0.03),
        worst("force on a fingertip, 2 ms [N]", (row["peak_n"] for row in rows), goal=PEAK),
        worst("force on palm or link, 2 ms [N]", (row["knock_n"] for row in rows)),
        middle("simulated [s]", (row["simulated_s"] for row in rows)),
    ]
    if any(row["lifted_m"] for row in rows):
        out += [
            share("lifted", (row["success"] for row in rows)),
            share("shaken six ways, < 2 cm", (max(r["shake_m"]) < SLIP for r in held), goal=0.95),
            share("pushed 20 N for 0.1 s, < 2 cm", (max(r["push_m"]) < SLIP for r in held), 0.9),
            middle("moved while fingers slid [m]", (row["moved_m"] for row in rows)),
        ]
    return out


def _ends_of(stuck: list[dict[str, Any]]) -> list[tuple[str, list[dict[str, Any]]]]:
    """Rows by how their first reach ended."""
    names = sorted({row["ends"][0] for row in stuck})
    return [(name, [row for row in stuck if row["ends"][0] == name]) for name in names]


def _again(stuck: list[dict[str, Any]]) -> list[bool]:
    return [row["converged"] for row in stuck]
