"""How pictures look, and how they are saved."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

DRAWN, MEANT, ERROR = "#1f4e9c", "#e08a1e", "#b3261e"
plt.rcParams.update(
    {
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.alpha": 0.3,
        "font.size": 10,
        "figure.dpi": 110,
    }
)


def save(folder: Path, figures: Iterable[tuple[str, Figure | None]]) -> list[Path]:
    """Write figures as ``<name>.png``, closing each before the next is drawn; returns the files."""
    out = []
    for name, figure in figures:
        if figure is None:
            continue
        path = folder / f"{name}.png"
        figure.savefig(path, metadata={"Software": None})
        plt.close(figure)
        out.append(path)
    return out


def once(axis: Any) -> None:
    """A legend that names every label once."""
    handles, labels = axis.get_legend_handles_labels()
    axis.legend(
        *zip(
            *dict(zip(labels, zip(handles, labels, strict=True), strict=True)).values(), strict=True
        )
    )
