"""Is the estimate as good as it says: innovations and errors over what they should be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from observer.metrics import chi2_band
from services.logs.runlog import RunLog
from services.reports.curves import broken, hermite, known
from services.topics import ESTIMATE, TRUTH

Array = NDArray[np.float64]

DOF = 3
"""Components of an innovation, and of a pose."""
WINDOW = 2.0
"""The running mean is over so long [s]."""
DOTS, MEAN, RIGHT = "0.75", "#1f4e9c", "#e08a1e"


@dataclass(frozen=True)
class Consistency:
    """Normalised squares over time, each of mean ``DOF`` if the observer is right.

    Attributes:
        odometry: instants (n,) [s] and NIS (n,) of the odometry's innovations.
        moving: NIS of those of them during which the platform was not taken to stand: standing
            odometry stays on one rounded value, and tells nothing.
        imu: the same of the IMU's.
        truth: instants and squared error of the pose in units of the reported covariance (NEES).
        inside: share of valid estimates with truth within 3 sigma in x, y and heading; NaN
            without truth.
    """

    odometry: tuple[Array, Array]
    moving: Array
    imu: tuple[Array, Array]
    truth: tuple[Array, Array]
    inside: float


def consistency_of(log: RunLog) -> Consistency:
    """What a run says of its observer; empty arrays where it says nothing."""
    estimates = log.series(ESTIMATE)
    odometry = _new([(e.t, e.odometry_age, e.odometry_nis, e.mode) for e in estimates])
    imu = _new([(e.t, e.imu_age, e.imu_nis, e.mode) for e in estimates])
    moving = np.array([nis for _, nis, mode in odometry if mode != "standing"])
    return Consistency(_columns(odometry), moving, _columns(imu), *_errors(log))


def _new(said: list[tuple[float, float, float, str]]) -> list[tuple[float, float, str]]:
    """Of t, age, NIS, mode: t, NIS, mode where a new measurement was used; it is its stamp, the
    difference of the first two, that moves then."""
    out, last = [], -math.inf
    for t, age, nis, mode in said:
        if t - age > last + 1e-6 and nis > 0.0:
            out.append((t, nis, mode))
            last = t - age
    return out


def _columns(found: list[tuple[float, float, str]]) -> tuple[Array, Array]:
    return np.array([t for t, _, _ in found]), np.array([nis for _, nis, _ in found])


def _errors(log: RunLog) -> tuple[tuple[Array, Array], float]:
    truth = log.series(TRUTH)
    kept = [e for e in log.series(ESTIMATE) if e.valid and e.covariance[0, 0] > 0.0]
    if len(truth) < 2 or not kept:
        return (np.zeros(0), np.zeros(0)), math.nan
    stamps = np.array([x.t for x in truth])
    there = known(np.array([e.t for e in kept]), stamps)
    kept = [e for e, k in zip(kept, there, strict=True) if k]
    if not kept:
        return (np.zeros(0), np.zeros(0)), math.nan
    t = np.array([e.t for e in kept])
    pose, rate = np.array([x.pose for x in truth]), np.array([x.velocity for x in truth])
    error = np.array([e.pose for e in kept]) - hermite(t, stamps, pose, rate)
    P = np.array([e.covariance[:3, :3] for e in kept])
    nees = np.einsum("ni,ni->n", error, np.linalg.solve(P, error[:, :, None])[:, :, 0])
    sigma = np.sqrt(np.diagonal(P, axis1=1, axis2=2))
    return (t, nees), float((np.abs(error) <= 3.0 * sigma).all(axis=1).mean())


def consistency(log: RunLog, title: str) -> Figure | None:
    """NIS of odometry and IMU, and NEES of the pose, over time; None without innovations."""
    found = consistency_of(log)
    panels = [
        ("NIS of odometry", found.odometry),
        ("NIS of the IMU", found.imu),
        ("NEES of the pose\n(error / reported)", found.truth),
    ]
    panels = [(name, (t, x)) for name, (t, x) in panels if len(t) > 5]
    if not len(found.odometry[0]) or not panels:
        return None
    figure, axes = plt.subplots(
        len(panels), 1, figsize=(13, 2.7 * len(panels)), sharex=True, layout="constrained"
    )
    for axis, (name, (t, x)) in zip(np.atleast_1d(axes), panels, strict=True):
        k = slice(None, None, max(1, len(t) // 8000))
        axis.plot(t[k], np.maximum(x[k], 1e-2), ls="", marker=".", ms=2.5, color=DOTS)
        mean = broken(t[k], _running(t, x)[k], hole=WINDOW)
        axis.plot(*mean, color=MEAN, lw=1.4, label=f"mean over {WINDOW:g} s")
        axis.axhline(DOF, color=RIGHT, lw=1.2, label="3 is right")
        axis.axhline(chi2_band(DOF, 1)[1], color=RIGHT, lw=0.8, ls="--", label="97.5 % below this")
        axis.set(yscale="log", ylim=(1e-2, max(50.0, float(x.max()) * 1.3)), ylabel=name)
    np.atleast_1d(axes)[0].legend(loc="lower right", ncols=3, fontsize=8)
    np.atleast_1d(axes)[-1].set_xlabel("t [s]")
    figure.suptitle(title)
    return figure


def _running(t: Array, x: Array) -> Array:
    """Mean over the ``WINDOW`` around each instant."""
    sums = np.concatenate([[0.0], np.cumsum(x)])
    first = np.searchsorted(t, t - 0.5 * WINDOW, side="left")
    last = np.searchsorted(t, t + 0.5 * WINDOW, side="right")
    return (sums[last] - sums[first]) / np.maximum(last - first, 1)
