"""Figures of a drawing run: what was drawn against what was intended, from a run's messages."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deploy.task import BoardPose
from services.logs.runlog import RunLog
from services.messages import ArmStatus
from services.reports.curves import HOLE, axis_ratio, distance_to_path, hermite, known, rms
from services.topics import ARM_COMMAND, ARM_STATUS, ESTIMATE, TRUTH

Array = NDArray[np.float64]

DRAWING_FIGURES = (
    "line_rms_mm",
    "line_max_mm",
    "tracked_rms_mm",
    "circle_axis_ratio",
    "contact_fraction",
    "force_rms_error_n",
    "torque_step_fraction",
)
ESTIMATE_FIGURES = ("estimate_rms_mm", "estimate_rms_deg", "estimate_max_step_mm_per_ms")
PEN_FIGURES = ("estimate_at_pen_rms_mm", "line_over_estimate")

FORCE_WINDOW = 20
"""Force is judged on its mean over this many ticks of 1 ms."""
PAUSE = 0.1
"""A stroke that is not drawn for this long was interrupted [s]."""
ROUND = 0.98
"""A closed curve whose intended axes have at least this ratio is a circle."""
CLOSED = 1e-3
"""A stroke whose ends are this near to each other is a closed curve [m]."""


@dataclass(frozen=True)
class Stroke:
    """One stroke, sampled every 1 ms.

    Attributes:
        t: shape (n,) [s].
        drawn: pen tip in the board's plane, shape (n, 2) [m].
        force: of the pen on the board, shape (n,) [N].
        intended: the point intended at that instant, shape (n, 2) [m].
        force_reference: shape (n,) [N].
    """

    t: Array
    drawn: Array
    force: Array
    intended: Array
    force_reference: Array

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Where the pen is on the board."""
        return self.force > 0.0

    def contour_error(self) -> Array:
        """Distance of each drawn point to the intended path [m]; drawn means touching."""
        return distance_to_path(self.drawn[self.touching], self.intended)

    def tracked_error(self) -> Array:
        """Distance of each drawn point to the one intended at that instant [m]."""
        difference = (self.drawn - self.intended)[self.touching]
        return np.hypot(difference[:, 0], difference[:, 1])

    @property
    def closed(self) -> bool:
        """Whether the intended path comes back to where it began."""
        return bool(np.hypot(*(self.intended[-1] - self.intended[0])) < CLOSED)

    @property
    def round(self) -> bool:
        """Whether a circle is intended."""
        return self.closed and axis_ratio(self.intended) > ROUND


def strokes_of(log: RunLog) -> list[Stroke]:
    """The strokes of a run, in order; an interrupted one counts as several."""
    truth, statuses = log.series(TRUTH), log.series(ARM_STATUS)
    if not truth:
        return []
    stamps = np.array([x.t for x in truth])
    t = (stamps[:, None] + 0.001 * np.arange(-4, 1)[None, :]).ravel()
    samples = np.concatenate([x.recent for x in truth])
    out = []
    for mine in _pieces(statuses):
        ts = np.array([s.t for s in mine])
        reference = np.array([s.reference[:2] for s in mine])
        velocity = np.array([s.reference_velocity[:2] for s in mine])
        inside = (t >= ts[0]) & (t <= ts[-1])
        at = t[inside]
        if not inside.any():
            continue
        out.append(
            Stroke(
                t=at,
                drawn=samples[inside, :2],
                force=samples[inside, 3],
                intended=hermite(at, ts, reference, velocity),
                force_reference=np.interp(at, ts, [s.force_reference for s in mine]),
            )
        )
    return out


def _pieces(statuses: list[ArmStatus]) -> list[list[ArmStatus]]:
    """Statuses of each uninterrupted piece of a stroke."""
    pieces: list[list[ArmStatus]] = []
    previous: ArmStatus | None = None
    for status in statuses:
        if status.stroke:
            goes_on = (
                previous is not None
                and previous.stroke == status.stroke
                and status.t - previous.t < PAUSE
            )
            if goes_on:
                pieces[-1].append(status)
            else:
                pieces.append([status])
        previous = status
    return pieces


def figures_of(log: RunLog) -> dict[str, float | None]:
    """The figures of a run; None where there is nothing to judge."""
    strokes = [s for s in strokes_of(log) if s.touching.any()]
    out: dict[str, float | None] = dict.fromkeys(DRAWING_FIGURES)
    if strokes:
        contour = np.concatenate([s.contour_error() for s in strokes])
        tracked = np.concatenate([s.tracked_error() for s in strokes])
        touching = np.concatenate([s.touching for s in strokes])
        force = np.concatenate([force_error(s) for s in strokes])
        out["line_rms_mm"] = 1e3 * rms(contour)
        out["line_max_mm"] = 1e3 * float(contour.max())
        out["tracked_rms_mm"] = 1e3 * rms(tracked)
        out["contact_fraction"] = float(touching.mean())
        out["force_rms_error_n"] = rms(force)
        ratios = [axis_ratio(s.drawn[s.touching]) for s in strokes if s.round]
        if ratios:
            out["circle_axis_ratio"] = min(ratios)
    out["torque_step_fraction"] = torque_step_fraction(log)
    return out | estimate_figures(log)


def arm_worked(log: RunLog) -> bool:
    """Whether an arm had a program; one that only holds itself has no pen to judge."""
    return any(s.program or s.stroke or s.state != "idle" for s in log.series(ARM_STATUS))


def force_error(stroke: Stroke) -> Array:
    """Mean force over 20 ms less the force set for the stroke [N]."""
    kernel = np.ones(FORCE_WINDOW) / FORCE_WINDOW
    return np.convolve(stroke.force, kernel, mode="valid") - stroke.force_reference[-1]


def estimate_figures(log: RunLog) -> dict[str, float | None]:
    """Error of the estimate against truth, and its largest step beyond the true motion."""
    truth, estimates = log.series(TRUTH), [e for e in log.series(ESTIMATE) if e.valid]
    if len(truth) < 2 or len(estimates) < 2:
        return dict.fromkeys(ESTIMATE_FIGURES)
    t = np.array([x.t for x in truth])
    te = np.array([e.t for e in estimates])
    pose = np.array([e.pose for e in estimates])
    there = known(te, t)
    te, first = np.unique(te[there], return_index=True)  # robot time may have stood still
    pose = pose[there][first]
    if len(te) < 2:
        return dict.fromkeys(ESTIMATE_FIGURES)
    true = hermite(te, t, np.array([x.pose for x in truth]), np.array([x.velocity for x in truth]))
    error = pose - true
    apart = np.diff(te)
    steps = (np.diff(error[:, :2], axis=0) / (1e3 * apart)[:, None])[apart <= HOLE]
    return {
        "estimate_rms_mm": 1e3 * rms(np.hypot(error[:, 0], error[:, 1])),
        "estimate_rms_deg": float(np.degrees(rms(error[:, 2]))),
        "estimate_max_step_mm_per_ms": 1e3
        * float(np.hypot(steps[:, 0], steps[:, 1]).max(initial=0.0)),
    }


def pen_figures(log: RunLog, board: BoardPose) -> dict[str, float | None]:
    """What the estimate's error alone does to the line, and the line's error over it.

    An arm that follows the estimate perfectly puts the pen where the platform's pose error carries
    it: dp = -(e + e_heading z x (p - p_B)). Of that, what lies in the board and across the path is
    error of the line.

    Args:
        log: of a run.
        board: X_WS, of which the horizontal axis matters.
    """
    truth, estimates = log.series(TRUTH), log.series(ESTIMATE)
    # one sample, where a run is cut short, has no direction
    strokes = [s for s in strokes_of(log) if s.touching.any() and len(s.t) > 1]
    if not strokes or len(estimates) < 2:
        return dict.fromkeys(PEN_FIGURES)
    ts = np.array([x.t for x in truth])
    poses = np.array([x.pose for x in truth])
    rates = np.array([x.velocity for x in truth])
    te = np.array([e.t for e in estimates])
    believed = np.array([e.pose for e in estimates])
    moving = np.array([e.velocity for e in estimates])
    R, p = board.rotation(), board.position()
    across, contour = [], []
    for s in strokes:
        true = hermite(s.t, ts, poses, rates)
        error = hermite(s.t, te, believed, moving) - true
        pen = p[:2] + s.drawn[:, :1] * R[:2, 0]  # on the board; heights play no part
        arm = pen - true[:, :2]
        moved = -error[:, :2] - error[:, 2:] * np.column_stack([-arm[:, 1], arm[:, 0]])
        tangent = np.gradient(s.intended, axis=0)
        length = np.maximum(np.hypot(*tangent.T), 1e-12)
        across.append(((moved @ R[:2, 0]) * tangent[:, 1] / length)[s.touching])
        contour.append(s.contour_error())
    at_pen, line = 1e3 * rms(np.concatenate(across)), 1e3 * rms(np.concatenate(contour))
    return {"estimate_at_pen_rms_mm": at_pen, "line_over_estimate": line / max(at_pen, 1e-6)}


def torque_step_fraction(log: RunLog) -> float | None:
    """Largest torque step at a node change, as a multiple of the ordinary 99 % ripple.

    A step is the mean of five ticks after less the mean of five before, of the joint where it is
    largest [N m].
    """
    commands, statuses = log.series(ARM_COMMAND), log.series(ARM_STATUS)
    running = [s.t for s in statuses if s.state == "running"]
    if not running:
        return None
    t = np.array([c.t for c in commands])
    if len(t) < 10 or np.median(np.diff(t)) > 0.002:
        return None  # a thinned log does not show it
    tau = np.array([c.tau for c in commands])
    sums = np.vstack([np.zeros(tau.shape[1]), np.cumsum(tau, axis=0)])
    means = (sums[5:] - sums[:-5]) / 5.0
    step = np.abs(means[5:] - means[:-5]).max(axis=1)  # between t[i+4] and t[i+5]
    at = t[5 : 5 + len(step)]
    changes = [b.t for a, b in itertools.pairwise(statuses) if a.transitions != b.transitions]
    if not changes:
        return None
    near = np.zeros(len(at), dtype=bool)
    for change in changes:
        near |= np.abs(at - change) < 0.004
    ordinary = (at >= running[0]) & (at <= running[-1]) & ~near
    if not ordinary.any() or not near.any():
        return None
    return float(step[near].max() / np.percentile(step[ordinary], 99))
