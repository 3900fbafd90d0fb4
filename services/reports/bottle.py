"""Figures of a run in which a hand fetches a bottle, from its messages."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from deploy.task import BottleTask
from services.logs.runlog import RunLog
from services.topics import ARM_STATUS, TRUTH

Array = NDArray[np.float64]

BOTTLE_FIGURES = (
    "placed_error_mm",
    "placed_tilt_deg",
    "carried_tilt_deg",
    "carried_slip_mm",
    "tip_force_peak_n",
    "still_rms_mm",
    "still_max_mm",
    "still_rms_deg",
    "still_platform_mm",
    "still_platform_deg",
    "tries",
)
TIPS = ("tip0", "tip1", "tip2")
CARRIED = ("Hand_lift", "Hand_stay", "Hand_carry", "Hand_lower")
"""Types of nodes in which the bottle is off the table; programs name theirs after them."""
NEAR, UPRIGHT = 0.02, math.radians(3.0)
"""A bottle is placed within this of its goal [m], this upright [rad]."""
MIDDLE = 0.1
"""Of the bottle, above its foot [m]."""


@dataclass(frozen=True)
class Bottled:
    """The truth of a run with a bottle, n samples.

    Attributes:
        t: shape (n,) [s].
        node: the program's node at each, n names.
        foot: of the bottle in W, shape (n, 3) [m], and its ``tilt`` (n,) [rad].
        palm: in W, shape (n, 3) [m], and ``turn`` of it, n rotations.
        held: middle of the bottle in the palm's frame, shape (n, 3) [m].
        force: on each tip, shape (n, 3) [N].
        pose: of the platform, shape (n, 3).
    """

    t: Array
    node: Array
    foot: Array
    tilt: Array
    palm: Array
    turn: Rotation
    held: Array
    force: Array
    pose: Array

    def during(self, *kinds: str) -> NDArray[np.bool_]:
        """Mask of samples in nodes that are called as node types are, less ``Hand_``."""
        return np.isin(self.node, [kind.removeprefix("Hand_").capitalize() for kind in kinds])


def bottled(log: RunLog) -> Bottled | None:
    """What hand and bottle did; None where there is none."""
    truth = [m for m in log.series(TRUTH) if "palm" in m.bodies and TIPS[0] in m.forces]
    if len(truth) < 2:
        return None
    nowhere = [math.nan] * 3 + [1.0, 0.0, 0.0, 0.0]
    bottle = np.array([m.bodies.get("bottle", nowhere) for m in truth])
    palm = np.array([m.bodies["palm"] for m in truth])
    R = Rotation.from_quat(bottle[:, 3:], scalar_first=True)
    turn = Rotation.from_quat(palm[:, 3:], scalar_first=True)
    up = R.as_matrix()[:, :, 2]
    t = np.array([m.t for m in truth])
    status = log.series(ARM_STATUS)
    at = np.searchsorted([s.t for s in status], t, side="right") - 1
    return Bottled(
        t=t,
        node=np.array([status[i].node if i >= 0 else "" for i in at]),
        foot=bottle[:, :3],
        tilt=np.arccos(np.clip(up[:, 2], -1.0, 1.0)),
        palm=palm[:, :3],
        turn=turn,
        held=turn.inv().apply(bottle[:, :3] + MIDDLE * up - palm[:, :3]),
        force=np.array([[math.hypot(*m.forces[tip]) for tip in TIPS] for m in truth]),
        pose=np.array([m.pose for m in truth]),
    )


def bottle_figures(log: RunLog, task: BottleTask | None) -> dict[str, float | bool | None]:
    """How the bottle was taken, carried and placed; nothing where no hand is.

    ``placed`` asks for the program's end of that name, the bottle upright within ``NEAR`` of its
    goal, and that it has never been dropped. ``still`` is of the palm about its own mean in W
    while the platform goes to and fro.

    Args:
        log: of a run.
        task: what the hand was told.
    """
    seen = bottled(log)
    if seen is None or task is None:
        return {}
    out: dict[str, float | bool | None] = dict.fromkeys(BOTTLE_FIGURES)
    off = seen.foot[-1, :2] - task.goal
    tilt = float(seen.tilt[-1])
    last = log.series(ARM_STATUS)[-1]
    error = float(np.hypot(*off))
    stands = abs(float(seen.foot[-1, 2]) - task.table) < 0.01
    out["placed"] = bool(last.node == "Placed" and error < NEAR and tilt < UPRIGHT and stands)
    if math.isfinite(error):
        out |= {"placed_error_mm": 1e3 * error, "placed_tilt_deg": math.degrees(tilt)}
    carried = seen.during(*CARRIED)
    if carried.any():
        out["carried_tilt_deg"] = math.degrees(float(seen.tilt[carried].max()))
        moved = np.linalg.norm(seen.held[carried] - seen.held[carried][0], axis=1)
        out["carried_slip_mm"] = 1e3 * float(moved.max())
    out["tip_force_peak_n"] = float(seen.force.max())
    still = seen.during("Hand_stay")
    if still.sum() > 2:
        away = np.linalg.norm(seen.palm[still] - seen.palm[still].mean(axis=0), axis=1)
        turned = (seen.turn[still].mean().inv() * seen.turn[still]).magnitude()
        pose = seen.pose[still]
        out |= {
            "still_rms_mm": 1e3 * float(np.sqrt(np.mean(away**2))),
            "still_max_mm": 1e3 * float(away.max()),
            "still_rms_deg": math.degrees(float(np.sqrt(np.mean(turned**2)))),
            "still_platform_mm": 1e3 * float(np.hypot(*np.ptp(pose[:, :2], axis=0))),
            "still_platform_deg": math.degrees(float(np.ptp(pose[:, 2]))),
        }
    entered = seen.during("Hand_grasp")
    out["tries"] = float(np.count_nonzero(np.diff(entered.astype(int)) > 0))
    return out
