"""Rows stacked into columns: a long program becomes a page of about a screen's shape."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from arm.hds.drawing import ASPECT, GAP, GUTTER, HIGH, MARGIN, MOST, ROW, TOP, TRACK
from arm.hds.layout import Slot, apart


@dataclass
class Row:
    """A row with its upper edge, its height, and the free height below it [px]."""

    slots: list[Slot]
    height: float
    below: float
    y: float = 0.0

    @property
    def bottom(self) -> float:
        """Its lower edge [px]."""
        return self.y + self.height


@dataclass
class Column:
    """Rows above each other.

    Attributes:
        rows: from top to bottom.
        crossing: links that lead on to the next column.
        left: its left edge [px].
        right: its right edge [px].
    """

    rows: list[Row]
    crossing: int = 0
    left: float = 0.0
    right: float = 0.0

    @property
    def height(self) -> float:
        """Of its rows [px]."""
        return sum(row.height + row.below for row in self.rows)


def fold(rows: Sequence[list[Slot]], heights: Mapping[int, float]) -> list[Column]:
    """Columns with places for all slots; ``x`` of the slots and ``y`` of the rows are final.

    Args:
        rows: slots with their places along the rows; rows of boxes and of labels alternate.
        heights: height of each item [px].
    """
    stacked = [_row(slots, heights) for slots in rows]
    cuts = min(
        (_cuts(stacked, count) for count in range(1, MOST + 1)),
        key=lambda cuts: _misfit(stacked, cuts),
    )
    columns = []
    edges = [0, *cuts, len(stacked)]
    for first, last in pairwise(edges):
        columns.append(Column(stacked[first:last]))
        if last < len(stacked):
            _tail(columns[-1], stacked[last], heights)
    _place(columns)
    return columns


def _row(slots: list[Slot], heights: Mapping[int, float]) -> Row:
    height = max((heights[s.item] for s in slots if s.item is not None), default=0.0)
    slant = max((abs(low.x - s.x) for s in slots for low in s.below), default=0.0)
    return Row(slots, height, ROW + min(40.0, 0.1 * slant))


def _cuts(rows: list[Row], count: int) -> list[int]:
    """Where to cut for columns of about the same height: below labels, where few links cross."""
    share = sum(row.height + row.below for row in rows) / count
    cuts: list[int] = []
    for k in range(1, count):
        down, best = 0.0, (math.inf, 0)
        for i, row in enumerate(rows[:-1]):
            down += row.height + row.below
            off = abs(down - k * share) / share
            if i % 2 == 1 and off < 0.35 and i + 1 not in cuts:
                on = sum(not _leaf(lower) for slot in row.slots for lower in slot.below)
                best = min(best, (on + 6.0 * off, i + 1))
        if best[1]:
            cuts.append(best[1])
    return sorted(cuts)


def _misfit(rows: list[Row], cuts: list[int]) -> float:
    """How far the page is from a screen's shape; one that is not high needs no folding."""
    width = height = 0.0
    for first, last in pairwise([0, *cuts, len(rows)]):
        inside = [slot for row in rows[first:last] for slot in row.slots]
        right = max(s.x + s.width / 2 for s in inside)
        width += right - min(s.x - s.width / 2 for s in inside) + GUTTER
        height = max(height, sum(row.height + row.below for row in rows[first:last]))
    small = not cuts and height <= HIGH
    return 0.0 if small else abs(math.log(width / height / ASPECT))


def _leaf(slot: Slot) -> bool:
    """Whether it is the end of one way and nothing else."""
    return slot.item is not None and not slot.below and len(slot.above) == 1


def _tail(column: Column, following: Row, heights: Mapping[int, float]) -> None:
    """Keep in a column what ends right below it, in a row of its own."""
    tail: list[Slot] = []
    for slot in column.rows[-1].slots:
        for lower in slot.below:
            tail.append(lower if _leaf(lower) else Slot(None, 0.0, slot.x, weight=100.0))
            column.crossing += not _leaf(lower)
    following.slots = [slot for slot in following.slots if slot not in tail]
    if any(slot.item is not None for slot in tail):
        apart(tail, [slot.above[0].x if slot.item is not None else slot.x for slot in tail], GAP)
        column.rows.append(_row(tail, heights))


def _place(columns: list[Column]) -> None:
    x, tracks = MARGIN, 0
    for column in columns:
        inside = [slot for row in column.rows for slot in row.slots]
        left = min(slot.x - slot.width / 2 for slot in inside)
        y = TOP + tracks * TRACK
        for row in column.rows:
            row.y = y
            y += row.height + row.below
        for slot in inside:
            slot.x += x - left
        column.left, column.right = x, max(slot.x + slot.width / 2 for slot in inside)
        tracks = column.crossing
        x = column.right + GUTTER + tracks * TRACK
