"""Reads the curves of an SVG file: what a pen would draw of it, in the file's own order.

The library is imported where it is used: checking a program without a file must be quick.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from arm.nodes.node import Array

if TYPE_CHECKING:
    from svgelements import Path as SvgPath

FLATNESS = 5e-6
"""Largest distance of a curve to the chords it is made into [m]."""
TURN = 0.1
"""Largest turn from one chord to the next within a curve [rad]."""
DEEPEST = 12
"""A curve is halved no more often than this."""


def read_strokes(file: Path, width: float, centre: tuple[float, float]) -> list[Array]:
    """The curves of a file on the board, each continuous.

    Transforms are applied, shapes are drawn by their outline, hidden elements are left out, and
    so are text and images.

    Args:
        file: an SVG file.
        width: of all that is drawn, on the board [m]; the height follows.
        centre: where its middle goes: right and up of the board's origin [m].

    Returns:
        Vertices of polylines within ``FLATNESS`` of the curves, shapes (n, 2) [m].

    Raises:
        ValueError: not an SVG file, or nothing in it to draw.
    """
    subpaths = _subpaths(file)
    box = np.array([path.bbox() for path in subpaths if path.bbox() is not None])
    if len(box) == 0:
        raise ValueError(f"{file.name} has no curve to draw")
    x0, y0 = box[:, :2].min(axis=0)
    x1, y1 = box[:, 2:].max(axis=0)
    if not x1 > x0:
        raise ValueError(f"what {file.name} draws has no width, so it cannot be scaled to one")
    scale = width / (x1 - x0)
    middle = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0])
    strokes = []
    for path in subpaths:
        points = _flatten(path, FLATNESS / scale)
        if len(points) > 1 and np.ptp(points, axis=0).max() * scale > 1e-6:
            # y of the file points down
            strokes.append((points - middle) * np.array([scale, -scale]) + np.array(centre))
    return strokes


def _subpaths(file: Path) -> list[SvgPath]:
    from svgelements import SVG, Shape
    from svgelements import Path as SvgPath

    try:
        drawing = SVG.parse(str(file), reify=True)
    except Exception as error:  # of the XML parser or of a number in it
        raise ValueError(f"{file.name} is not a readable SVG file: {error}") from None
    found = []
    for element in drawing.elements():
        if not isinstance(element, Shape) or _hidden(element):
            continue
        path = abs(SvgPath(element))
        found += [SvgPath(sub) for sub in path.as_subpaths()]
    return found


def _hidden(element: Any) -> bool:
    values = element.values
    return values.get("display") == "none" or values.get("visibility") in ("hidden", "collapse")


def _flatten(path: SvgPath, flatness: float) -> Array:
    """Vertices of a subpath, in the file's units, shape (n, 2)."""
    from svgelements import Close, Line, Move

    points: list[complex] = []
    for segment in path:
        if isinstance(segment, Move):
            continue
        start, end = _complex(segment.start), _complex(segment.end)
        if not points:
            points.append(start)
        if not isinstance(segment, (Line, Close)):
            # four pieces at least: the middle of an S lies on its chord
            marks = [(k / 4.0, _complex(segment.point(k / 4.0))) for k in range(5)]
            for (a, p), (b, q) in pairwise(marks):
                _halve(segment, a, b, p, q, flatness, DEEPEST, points)
        points.append(end)
    return np.array([(p.real, p.imag) for p in points]).reshape(-1, 2)


def _halve(
    segment: Any,
    a: float,
    b: float,
    p: complex,
    q: complex,
    flat: float,
    deep: int,
    out: list[complex],
) -> None:
    """Append the curve from ``a`` (at p) to ``b`` (at q), p left out."""
    middle = 0.5 * (a + b)
    m = _complex(segment.point(middle))
    chord, first, second = q - p, m - p, q - m
    if deep > 0 and abs(first) > 0 and abs(second) > 0:
        away = abs((chord.conjugate() * first).imag) / abs(chord) if abs(chord) > 0 else abs(first)
        turn = abs(math.remainder(_angle(second) - _angle(first), 2.0 * math.pi))
        if away > flat or turn > TURN:
            _halve(segment, a, middle, p, m, flat, deep - 1, out)
            _halve(segment, middle, b, m, q, flat, deep - 1, out)
            return
    out.append(q)


def _angle(z: complex) -> float:
    return math.atan2(z.imag, z.real)


def _complex(point: Any) -> complex:
    return complex(float(point.x), float(point.y))
