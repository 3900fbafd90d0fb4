"""Picture of the platform: truth against estimate, and their difference."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from deploy.task import BoardPose
from services.logs.runlog import RunLog
from services.messages import BoardEstimate
from services.reports.curves import broken, hermite, known
from services.reports.style import DRAWN, ERROR, MEANT, plt
from services.topics import BOARD, ESTIMATE, TRUTH
from sim.scenario import Scenario

Array = NDArray[np.float64]

AT_BOARD = "#1b7f3b"


def estimate(log: RunLog, title: str, scenario: Scenario | None = None) -> Figure | None:
    """Platform truth against estimate, and their difference; nothing where nothing is known.

    Args:
        log: of a run.
        title: of the picture.
        scenario: that was run, for its board: where a camera watches it, the difference is also
            shown as seen from there.
    """
    truth, estimates = log.series(TRUTH), log.series(ESTIMATE)
    if len(truth) < 2 or len(estimates) < 2:
        return None
    t = np.array([x.t for x in truth])
    pose = np.array([x.pose for x in truth])
    te = np.array([e.t for e in estimates])
    valid = np.array([e.valid for e in estimates])[:, None]
    believed = np.where(valid, np.array([e.pose for e in estimates]), np.nan)
    sigma = np.where(valid, np.sqrt([e.covariance.diagonal()[:3] for e in estimates]), np.nan)
    true = hermite(te, t, pose, np.array([x.velocity for x in truth]))
    true = np.where(known(te, t)[:, None], true, np.nan)
    lines = [("error", ERROR, believed - true)]
    if scenario is not None and (boards := log.series(BOARD)):
        seen = from_board(te, believed, boards, scenario.world.board)
        lines.append(("error, the board where it is seen", AT_BOARD, seen - true))
    t, pose = broken(t, pose)
    at, believed, sigma = broken(te, believed, sigma)
    figure, axes = plt.subplots(3, 2, figsize=(13, 8), sharex=True, layout="constrained")
    names = (("x", 1e3, "mm"), ("y", 1e3, "mm"), ("heading", 180 / np.pi, "deg"))
    for i, (name, scale, unit) in enumerate(names):
        value, difference = axes[i]
        value.plot(t, scale * pose[:, i], color=MEANT, lw=4, alpha=0.5, label="truth")
        value.plot(at, scale * believed[:, i], color=DRAWN, lw=1, label="estimate, where valid")
        value.set_ylabel(f"{name} [{unit}]")
        band = 3 * scale * sigma[:, i]
        difference.fill_between(at, -band, band, color="0.85", lw=0, label="3 sigma, as reported")
        for label, colour, error in lines:
            moment, shown = broken(te, scale * error[:, i])
            difference.plot(moment, shown, color=colour, lw=0.8, label=label)
        difference.set_ylabel(f"error of {name} [{unit}]")
        errors = np.abs(np.concatenate([scale * error[:, i] for _, _, error in lines]))
        reach = np.nanmax(errors) if np.isfinite(errors).any() else 1.0
        difference.set_ylim(*(1.3 * max(reach, 1e-3) * np.array([-1, 1])))
    for axis in axes[0]:  # above, where it hides nothing
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
    for axis in axes[2]:
        axis.set_xlabel("t [s]")
    figure.suptitle(title)
    return figure


def from_board(t: Array, believed: Array, boards: list[BoardEstimate], board: BoardPose) -> Array:
    """Where a pose that is believed lies if the board is where it truly is, not where it drifted.

    Args:
        t: instants, shape (n,) [s].
        believed: X_OB then, shape (n, 3) [m, m, rad].
        boards: X_OS as estimated over time.
        board: X_WS.

    Returns:
        X_WB, shape (n, 3) [m, m, rad].
    """
    ts = np.array([b.t for b in boards])
    x, y, yaw = (np.interp(t, ts, column) for column in np.array([b.pose for b in boards]).T)
    turned = board.yaw - yaw
    c, s = np.cos(turned), np.sin(turned)
    dx, dy = believed[:, 0] - x, believed[:, 1] - y
    place = [board.x + c * dx - s * dy, board.y + s * dx + c * dy, believed[:, 2] + turned]
    seen = np.column_stack(place)
    seen[~known(t, ts)] = np.nan
    return seen
