"""Pictures that experiments share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from services.reports.style import DRAWN, ERROR, MEANT
from services.trials.lines import Line


def distributions(values: Mapping[str, Sequence[float]], lines: Mapping[str, Line]) -> Figure:
    """One panel a figure: the share of trials at or below each value, median, interval, goal.

    Args:
        values: of the trials, by label.
        lines: of the summary, by the same labels; where there is none, only the values are drawn.
    """
    n = max(1, len(values))
    figure, axes = plt.subplots(
        1, n, figsize=(4.2 * n, 3.6), sharey=True, squeeze=False, layout="constrained"
    )
    for axis, (label, mine) in zip(axes[0], values.items(), strict=False):
        axis.ecdf(mine, color=DRAWN, lw=1.8)
        axis.plot(mine, np.full(len(mine), -0.03), "|", color=DRAWN, alpha=0.6)
        line = lines.get(label)
        if line is not None and line.value is not None:
            axis.axvline(line.value, color=MEANT, lw=1.5, label="median")
            if line.low is not None and line.high is not None:
                axis.axvspan(line.low, line.high, color=MEANT, alpha=0.25, lw=0, label="95 %")
        if line is not None and line.goal is not None:
            axis.axvline(line.goal, color=ERROR, lw=1.2, ls="--", label="goal")
        axis.set_xlabel(label)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(loc="lower right")
    axes[0, 0].set_ylabel("share of trials")
    return figure
