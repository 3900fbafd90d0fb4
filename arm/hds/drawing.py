"""Gives a sketch its places: boxes, arrows that cross no box, labels that overlap nothing.

Every label is laid out as an item of its own between the two boxes it belongs to. Between two
rows there is nothing but arrows, and where an arrow passes a row it has a place in that row. Long
programs are folded into columns; what would lead far across the picture, or to a node many lead
to, ends at a small flag with the name of its target instead.
"""

from __future__ import annotations

from dataclasses import dataclass

from arm.hds.sketch import Arrow, Box

NAME, TEXT, LINE = 13.0, 10.5, 14.5
"""Sizes of a node's name and of everything else, and the height of a line [px]."""
TITLE, TITLE_X = 12.0, 20.0
"""Size of the title, and where it begins [px]."""
PAD, GAP, ROW = 10.0, 26.0, 20.0
"""Inside a box; between what stands side by side; between rows [px]."""
LOOP = 26.0
"""How far an arrow from a node to itself stands out [px]."""
START = 28.0
"""Room beside the initial node for its mark [px]."""
FLAG = 18.0
"""Height of a flag [px]."""
FAR, HUB = 5, 5
"""Arrows over more rows of boxes, or to nodes with so many arrows, end at a flag."""
MARGIN, TOP = 20.0, 64.0
"""Around the picture, and above it for title and legend [px]."""
HIGH = 900.0
"""A picture up to this height is not folded [px]."""
ASPECT = 1.5
"""Width to height a folded picture comes near to."""
PORT = 18.0
"""Between two arrows that leave or reach a box on the same side [px]."""
MOST = 8
"""Columns at most."""
TRACK, GUTTER = 8.0, 34.0
"""Between arrows that go from column to column; between the columns [px]."""


@dataclass(frozen=True)
class Placed:
    """A box, flag or label with its place; ``x`` and ``y`` are its upper left corner."""

    x: float
    y: float
    width: float
    height: float
    box: Box | None = None
    flag: str = ""
    label: Arrow | None = None


@dataclass(frozen=True)
class Route:
    """An arrow's line.

    Attributes:
        arrow: what it is.
        path: from source to target, ``(kind, x, y)``: ``M`` start here, ``L`` straight, ``S`` in a
            curve that leaves and arrives upright.
        up: it arrives from below.
    """

    arrow: Arrow
    path: tuple[tuple[str, float, float], ...]
    up: bool = False


@dataclass(frozen=True)
class Drawing:
    """A picture: title, size, and what stands where."""

    title: str
    width: float
    height: float
    boxes: tuple[Placed, ...]
    flags: tuple[Placed, ...]
    labels: tuple[Placed, ...]
    routes: tuple[Route, ...]
    loops: tuple[Arrow, ...]


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Width of a text in a common sans-serif font, rather too large than too small [px]."""
    units = 0.0
    for char in text:
        if char in "ijl.,:;|!'()[] ":
            units += 0.36
        elif char in "frt-/":
            units += 0.42
        elif char in "mwMW%@":
            units += 0.95
        else:
            units += 0.72 if char.isupper() else 0.63
    return units * size * (1.1 if bold else 1.0)
