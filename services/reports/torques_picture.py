"""Picture of the joints' torques."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from services.logs.runlog import RunLog
from services.messages import ArmStatus
from services.reports.curves import broken
from services.reports.style import DRAWN, MEANT, plt
from services.topics import ARM_COMMAND, ARM_STATUS

NAMED = "#a35f00"
"""Colour of nodes' names: that of their marks, dark enough to read."""
NAME_WIDTH = 0.0075
"""Of a letter of a node's name, over the width of the picture."""


def torques(log: RunLog, title: str) -> Figure | None:
    """Joint torques over time; nodes are named above where there is room, their changes marked."""
    commands, statuses = log.series(ARM_COMMAND), log.series(ARM_STATUS)
    if not commands:
        return None
    t, tau = broken(np.array([c.t for c in commands]), np.array([c.tau for c in commands]))
    joints = tau.shape[1]
    size = (13, max(10.0, 1.2 * joints))
    figure, axes = plt.subplots(joints, 1, figsize=size, sharex=True, layout="constrained")
    changes = [b for a, b in itertools.pairwise(statuses) if a.node != b.node]
    for i, axis in enumerate(axes):
        axis.plot(t, tau[:, i], color=DRAWN, lw=0.7)
        axis.set_ylabel(f"joint {i + 1}\n[N m]")
        for change in changes:
            axis.axvline(change.t, color=MEANT, lw=0.8, alpha=0.7)
    axes[0].set_xlim(t[0], t[-1])
    figure.align_ylabels()
    _name_nodes(axes[0], [*statuses[:1], *changes], t[-1])
    axes[-1].set_xlabel("t [s] (lines: changes of node; its name is above where there is room)")
    figure.suptitle(title)
    return figure


def _name_nodes(axis: Any, starts: list[ArmStatus], end: float) -> None:
    """Write nodes' names above an axis, each over its own stretch, level or upright if it fits."""
    low, high = axis.get_xlim()
    ends = [*(s.t for s in starts[1:]), end]
    for start, until in zip(starts, ends, strict=True):
        room = (until - start.t) / (high - low)
        level = room > NAME_WIDTH * len(start.node)
        if start.node and (level or room > 2.0 * NAME_WIDTH):
            axis.text(
                0.5 * (start.t + until), 1.03, start.node, transform=axis.get_xaxis_transform(),
                rotation=0 if level else 90, ha="center", va="bottom", fontsize=8, color=NAMED,
            )  # fmt: skip
