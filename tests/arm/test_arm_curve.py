"""Curves from SVG files, and how they are run through."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from arm.nodes.curve import SAMPLE, SMOOTHING, Curve, CurveLaw
from arm.nodes.svg_file import read_strokes
from arm.nodes.whiteboard_wipe import wipe_rows
from deploy.task import PROGRAMS

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" width="100" height="100" viewBox="0 0 100 100">'


def svg(folder: Path, body: str) -> Path:
    """A file with these elements."""
    path = folder / "drawing.svg"
    path.write_text(f"{HEAD}{body}</svg>")
    return path


def trace(law: CurveLaw, dt: float = SAMPLE) -> tuple[np.ndarray, np.ndarray]:
    """Arc length and speed at every tick."""
    out = []
    while not law.done:
        out.append(law.step(dt))
    s, v = np.array(out).T
    return s, v


def test_curves_are_flattened_to_micrometres(tmp_path: Path) -> None:
    """Every point of a circle drawn 80 mm wide is within 10 um of it, and its length is right."""
    file = svg(tmp_path, '<circle cx="30" cy="50" r="20"/>')
    (points,) = read_strokes(file, 0.08, (0.1, -0.05))
    curve = Curve(points)
    radius = np.hypot(*(curve.points - np.array([0.1, -0.05])).T)
    assert np.abs(radius - 0.04).max() < 1e-5
    assert curve.length == pytest.approx(2 * np.pi * 0.04, rel=1e-4)


def test_subpaths_are_strokes_in_the_order_of_the_file(tmp_path: Path) -> None:
    """Two subpaths and a shape make three strokes; y of the file points down, ours up; transforms
    count; what is hidden is not drawn."""
    file = svg(
        tmp_path,
        '<path d="M 0 0 L 10 0 M 0 10 C 3 10 7 10 10 10"/>'
        '<g transform="translate(0 20)"><polyline points="0,0 10,0 10,10"/></g>'
        '<path d="M 50 50 L 90 90" display="none"/>',
    )
    first, second, third = read_strokes(file, 0.1, (0.0, 0.0))
    np.testing.assert_allclose(first, [[-0.05, 0.15], [0.05, 0.15]], atol=1e-9)
    np.testing.assert_allclose(second[[0, -1]], [[-0.05, 0.05], [0.05, 0.05]], atol=1e-9)
    np.testing.assert_allclose(third, [[-0.05, -0.05], [0.05, -0.05], [0.05, -0.15]], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("not xml", "not a readable SVG file"),
        (f"{HEAD}</svg>", "no curve to draw"),
        (f'{HEAD}<path d="M 5 0 L 5 9"/></svg>', "no width"),
    ],
)
def test_a_file_that_cannot_be_drawn_says_why(tmp_path: Path, text: str, why: str) -> None:
    """Nothing is drawn of what is not understood."""
    path = tmp_path / "bad.svg"
    path.write_text(text)
    with pytest.raises(ValueError, match=why):
        read_strokes(path, 0.1, (0.0, 0.0))


def test_a_sharp_corner_is_a_stop_and_a_blunt_one_is_not() -> None:
    """At 90 degrees the pen comes to rest; at 10 degrees it only slows."""
    for degrees, stops in ((90.0, True), (10.0, False)):
        a = np.radians(degrees)
        way = np.array([[0.0, 0.0], [0.05, 0.0], [0.05 + 0.05 * np.cos(a), 0.05 * np.sin(a)]])
        s, v = trace(CurveLaw(Curve(way), 0.05, 0.1))
        at_corner = v[np.abs(s - 0.05) < 2e-4].min()
        assert (at_corner < 1e-3) == stops
        assert (at_corner < 0.045) == stops or degrees == 10.0


def test_speed_acceleration_and_jerk_are_limited_also_in_bends() -> None:
    """A circle of 5 mm after a straight is taken at sqrt(a r); nowhere is there more speed, nor
    much more acceleration than allowed, and none changes at once."""
    speed, most, r = 0.1, 0.15, 0.005
    angle = np.linspace(-np.pi / 2, 1.5 * np.pi, 400)
    round_ = np.column_stack([0.1 + r * np.cos(angle), r + r * np.sin(angle)])
    curve = Curve(np.concatenate([[[0.0, 0.0]], round_]))
    s, v = trace(CurveLaw(curve, speed, most))
    assert v.max() == pytest.approx(speed, rel=0.02)
    in_bend = v[(s > 0.105) & (s < curve.length - 0.01)]
    assert in_bend.max() < 1.03 * np.sqrt(most * r)
    points = np.array([curve.at(x)[0] for x in s])
    assert np.abs(np.diff(v)).max() / SAMPLE < 1.05 * most
    jerk = np.diff(v, 2) / SAMPLE**2
    assert np.abs(jerk).max() < 2.2 * most / SMOOTHING
    assert np.diff(s).min() >= 0.0
    assert s[-1] == pytest.approx(curve.length, abs=1e-6)
    np.testing.assert_allclose(points[-1], round_[-1], atol=1e-5)


def test_speed_is_the_derivative_of_the_way() -> None:
    """What is fed forward as velocity is what the points do."""
    (points, *_) = read_strokes(PROGRAMS / "portrait.svg", 0.26, (0.0, 0.0))
    curve = Curve(points)
    law = CurveLaw(curve, 0.06, 0.15)
    s, v = trace(law)
    way = np.array([curve.at(x)[0] for x in s])
    fed = np.array([v[i] * curve.at(s[i])[1] for i in range(len(s))])
    moved = np.gradient(way, SAMPLE, axis=0)
    off = np.hypot(*(moved - fed).T)
    assert np.percentile(off, 99) < 2e-3
    assert off.max() < 6e-3


def test_an_interrupted_curve_goes_on_from_rest() -> None:
    """From 40 mm on: starts there at rest, and ends where the curve ends."""
    angle = np.linspace(0.0, np.pi, 300)
    curve = Curve(0.03 * np.column_stack([np.cos(angle), np.sin(angle)]))
    law = CurveLaw(curve, 0.05, 0.1, start=0.04)
    s, v = trace(law)
    assert s[0] < 1e-6
    assert v[0] < 1e-3
    assert 0.04 + s[-1] == pytest.approx(curve.length, abs=1e-6)


def test_the_portrait_is_longer_than_three_metres() -> None:
    """Drawn 260 mm wide it is 4 m of line in about 30 strokes, within the area that is reached."""
    strokes = read_strokes(PROGRAMS / "portrait.svg", 0.26, (0.0, 0.1))
    assert sum(Curve(points).length for points in strokes) > 3.5
    everything = np.concatenate(strokes)
    assert np.ptp(everything[:, 0]) == pytest.approx(0.26, abs=1e-4)
    assert everything[:, 1].min() > -0.12
    assert everything[:, 1].max() < 0.32


def test_wiping_leaves_no_strip() -> None:
    """Every point of the rectangle is within half a row of the way, which stays inside it."""
    way = Curve(wipe_rows(0.05, 0.03, 0.008)).points
    assert way.min(axis=0) == pytest.approx([0.0, -0.03], abs=1e-6)
    assert way.max(axis=0) == pytest.approx([0.05, 0.0], abs=1e-6)
    x, y = np.meshgrid(np.linspace(0.004, 0.046, 15), np.linspace(0.0, -0.03, 40))
    spots = np.column_stack([x.ravel(), y.ravel()])
    gaps = np.linalg.norm(spots[:, None] - way[None], axis=2).min(axis=1)
    assert gaps.max() <= 0.5 * 0.0075 + 2e-4
