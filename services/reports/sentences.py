"""One sentence a picture: what it shows in this run, with its figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from observer.metrics import chi2_band
from services.logs.runlog import RunLog
from services.reports.consistency import DOF, consistency_of
from services.reports.faults import HOLE, disturbances_of, lanes_of
from services.reports.loops import worst_of
from services.topics import ARM_COMMAND, BOARD, ESTIMATE

Figures = Mapping[str, Any]
HELD = ("safe_hold", "protective_stop")
"""States in which an arm only keeps its place or its joints."""


def board(log: RunLog, f: Figures) -> str:
    """Of what was drawn against what was intended."""
    return (
        f"The pen's line (blue) lies {_n(f, 'line_rms_mm')} mm rms and at most"
        f" {_n(f, 'line_max_mm')} mm from the intended one (orange); the right picture shows where."
    )


def drawing(log: RunLog, f: Figures) -> str:
    """Of what is on the board."""
    return "What is on the board at the end, and nothing else."


def estimate(log: RunLog, f: Figures) -> str:
    """Of the observer's pose against the truth."""
    if f.get("estimate_rms_mm") is None:
        return "The observer's pose (blue) was never valid beside a truth (orange)."
    seen = "; green: the same error, with the board where the camera sees it"
    return (
        f"The observer's pose (blue) is {_n(f, 'estimate_rms_mm')} mm and"
        f" {_n(f, 'estimate_rms_deg')} deg rms from the truth (orange), beside it the error within"
        " the three standard deviations that the observer itself reports (grey)"
        f"{seen if log.series(BOARD) else ''}."
    )


def consistency(log: RunLog, f: Figures) -> str:
    """Of the normalised innovations."""
    found, parts = consistency_of(log), []
    moving = len(found.moving) > 20
    wheels = found.moving if moving else found.odometry[1]
    when = "odometry while moving" if moving else "odometry, which stood"
    for name, nis in ((when, wheels), ("the IMU", found.imu[1])):
        if len(nis) > 5:
            low, high = chi2_band(DOF, len(nis))
            parts.append(
                f"{nis.mean():.2f} for {name} (chance alone: {low:.2f} to {high:.2f},"
                f" {len(nis)} innovations)"
            )
    inside = f"; the truth is within 3 sigma {100 * found.inside:.2f} % of the time"
    return (
        f"An observer that knows how good it is has a mean of 3: it is {' and '.join(parts)}"
        f"{inside if np.isfinite(found.inside) else ''}."
    )


def force(log: RunLog, f: Figures) -> str:
    """Of the pen's force."""
    share = f.get("contact_fraction")
    return (
        f"While drawing (shaded) the force over 20 ms is within {_n(f, 'force_rms_error_n')} N rms"
        " of the one that was set, and the pen touches the board"
        f" {'-' if share is None else f'{100 * share:.1f}'} % of the time."
    )


def torques(log: RunLog, f: Figures) -> str:
    """Of the joints' torques."""
    tau = np.array([c.tau for c in log.series(ARM_COMMAND)])
    joint = int(np.abs(tau).max(axis=0).argmax())
    step = f.get("torque_step_fraction")
    at = (
        ""
        if step is None
        else f"; the largest step at a change of node (orange) is {step:.2f} of the ordinary ripple"
    )
    return f"Joint {joint + 1} works hardest, with {np.abs(tau).max():.1f} N m at most{at}."


def loops(log: RunLog, f: Figures) -> str:
    """Of the loops' lateness."""
    found = worst_of(log, "arm") or worst_of(log, "observer")
    if found is None:
        return "How late each service's loop was."
    who = "arm" if worst_of(log, "arm") else "observer"
    p99, worst, missed = found
    return (
        f"99 % of the {who}'s ticks began less than {p99:.2f} ms late (median of the heartbeats),"
        f" the worst {worst:.1f} ms; {missed} ticks were missed."
    )


def timeline(log: RunLog, f: Figures) -> str:
    """Of what went wrong and what was done."""
    count = sum(span.what != HOLE for span in disturbances_of(log))
    invalid = sum(not e.valid for e in log.series(ESTIMATE)) / max(len(log.series(ESTIMATE)), 1)
    acted = f"{count} disturbance{'s' if count != 1 else ''}" if count else "No disturbance"
    held = [s for s in lanes_of(log).arm if s.what.partition(":")[0] in HELD]
    stood = sum(s.end - s.start for s in held)
    why = f" The arm held for {stood:.1f} s, first in {held[0].what}." if held else ""
    return (
        f"{acted} acted; shown is when, what the observer found wrong, and what arm and platform"
        f" did; the estimate was valid {100 * (1 - invalid):.2f} % of the time.{why}"
    )


def floor(log: RunLog, f: Figures) -> str:
    """Of the platform's way."""
    clear = f.get("platform_clearance_mm")
    near = f", never nearer than {clear:.0f} mm to an obstacle" if clear is not None else ""
    way = f.get("platform_way_m")
    return f"The platform from above: {'its way' if way is None else f'{way:.2f} m'}{near}."


def sharing(log: RunLog, f: Figures) -> str:
    """Of arm and platform on one way."""
    return (
        "Arm and platform share the way along the board: where pen and platform are, how fast, how"
        " much reach and speed the arm has left, and which behaviour voted for what."
    )


def grasp(log: RunLog, f: Figures) -> str:
    """Of two palms and a box."""
    return (
        f"The box is {_n(f, 'box_height_mm')} mm up at the end, tilted by {_n(f, 'box_tilt_deg')}"
        f" deg at most; no palm felt more than {_n(f, 'palm_force_peak_n')} N; bars show which goal"
        " regions the truth was in."
    )


def _n(figures: Figures, key: str) -> str:
    value = figures.get(key)
    return "-" if value is None else f"{value:.3g}"


SENTENCES = {
    f.__name__: f
    for f in (
        board,
        drawing,
        estimate,
        consistency,
        force,
        torques,
        loops,
        timeline,
        floor,
        sharing,
        grasp,
    )
}
"""By the name of the picture."""
