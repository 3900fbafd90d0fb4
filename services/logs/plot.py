"""Any numbers of a log over time, as a picture."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from services.logs.table import series_of
from services.messages import Array
from services.topics import TOPICS

POINTS = 20_000
"""A line has at most about so many; beyond that, smallest and largest of every stretch."""


def plot(path: Path, fields: Sequence[str], out: Path, span: tuple[float, float]) -> None:
    """Draw fields over time, one panel a field, one line a component.

    Args:
        path: of a whole log.
        fields: ``topic:path``, see ``table.series_of``.
        out: PNG, SVG or PDF to write.
        span: from and to [s].

    Raises:
        BadLog: no whole log, no such field, or nothing in that time.
        OSError: ``out`` cannot be written.
        ValueError: its ending is not that of a picture.
    """
    found = [series_of(path, field) for field in fields]
    figure = Figure(figsize=(12, 1.2 + 2.6 * len(fields)), dpi=110, layout="constrained")
    axes = figure.subplots(len(fields), 1, sharex=True, squeeze=False)[:, 0]
    for axis, field, lines in zip(axes, fields, found, strict=True):
        for name, (t, values) in lines.items():
            inside = (t >= span[0]) & (t <= span[1])
            label = name.partition(":")[2]
            axis.plot(*_thinned(t[inside], values[inside]), lw=0.9, label=label)
        axis.set_title(field, loc="left", fontsize=10)
        axis.set_ylabel(unit_of(field))
        axis.grid(alpha=0.3)
        axis.spines[["top", "right"]].set_visible(False)
        if len(lines) > 1:
            axis.legend(loc="upper right", fontsize=8, ncols=min(len(lines), 6))
    axes[-1].set_xlabel("t [s]")
    figure.savefig(out)


def unit_of(field: str) -> str:
    """Unit of a field as its message declares it, in brackets; nothing where it has none."""
    topic, _, path = field.partition(":")
    declared = {f.name: f.metadata.get("spec") for f in dataclasses.fields(TOPICS[topic].type)}
    spec = declared.get(path.partition(".")[0])
    return f"[{spec.unit}]" if spec is not None else ""


def _thinned(t: Array, values: Array) -> tuple[Array, Array]:
    """The same to the eye with fewer points: no peak is lost."""
    if len(t) <= POINTS:
        return t, values
    size = -(-2 * len(t) // POINTS)
    n = len(t) // size * size
    pieces = values[:n].reshape(-1, size)
    rows = np.arange(len(pieces))[:, None] * size
    picks = np.sort(np.stack([pieces.argmin(axis=1), pieces.argmax(axis=1)], axis=1), axis=1)
    keep = (rows + picks).ravel()
    return t[keep], values[keep]
