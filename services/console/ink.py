"""What has been drawn on the board so far, as line segments, in pieces that do not change again."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP = 0.001
"""Shortest segment [m]."""
SQUARE = 0.5 * STEP
"""Where there is ink is known by squares of this side [m]; no two segments in a row share one."""
JOIN = 0.02
"""Points further apart than this are not joined [m]: what lies between was not heard."""
PIECE = 200
"""Segments a piece: only the last one is sent again while it grows."""


class Ink:
    """Collects where the pen touched; what is drawn over again is there already.

    So a robot that draws the same for days does not fill the memory of who looks at it.

    Attributes:
        pieces: lists of segments, each (2, 2): its ends x, y in the board's frame [m].
    """

    def __init__(self) -> None:
        self.pieces: list[list[Array]] = [[]]
        self._from: Array | None = None
        self._inked: set[tuple[int, int]] = set()
        """Squares with the middle of a segment in them."""

    def touch(self, tip: Array, contact: bool) -> None:
        """Hear of the pen.

        Args:
            tip: p_ST_S, shape (3,) [m].
            contact: whether it touches.
        """
        if not contact:
            self._from = None
            return
        point = np.array(tip[:2])
        if self._from is not None:
            gap = np.hypot(*(point - self._from))
            if gap < STEP:
                return
            if gap < JOIN and self._is_new(0.5 * (self._from + point)):
                if len(self.pieces[-1]) >= PIECE:
                    self.pieces.append([])
                self.pieces[-1].append(np.array([self._from, point]))
        self._from = point

    def _is_new(self, middle: Array) -> bool:
        x, y = np.floor(middle / SQUARE).tolist()
        square = int(x), int(y)
        new = square not in self._inked
        self._inked.add(square)
        return new

    @property
    def length(self) -> float:
        """Of all segments [m]."""
        return float(sum(np.hypot(*(b - a)) for piece in self.pieces for a, b in piece))
