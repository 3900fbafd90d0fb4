"""Pictures: nothing overlaps, no arrow crosses a box, everything a person looks for is there."""

from __future__ import annotations

import itertools
import time
from xml.etree import ElementTree

import pytest

from arm.hds import Registry, check_text
from arm.hds.arrange import draw
from arm.hds.broken import broken_sketch
from arm.hds.diagram import dot, mermaid
from arm.hds.drawing import TITLE, TITLE_X, Drawing, Placed, Route, text_width
from arm.hds.layout import layered
from arm.hds.sketch import sketch
from arm.hds.svg import render, svg
from tests.arm.hds.automata import TYPES, chain, program, random_table

NAMESPACE = "{http://www.w3.org/2000/svg}"


def drawings() -> list[Drawing]:
    """Chains of 5 to 50 nodes and random automata, most with cycles, some not connected."""
    made = [chain(size, seed) for size in (5, 12, 20, 35, 50) for seed in (1, 2, 3)]
    made += [program(random_table(seed, size=4 + seed % 9)) for seed in range(60)]
    return [draw(sketch(one, TYPES)) for one in made]


@pytest.fixture(scope="module")
def drawn() -> list[Drawing]:
    """Drawn once."""
    return drawings()


def overlap(a: Placed, b: Placed, gap: float = 0.0) -> bool:
    """Whether two rectangles share more than an edge."""
    return (
        a.x < b.x + b.width + gap - 1e-6
        and b.x < a.x + a.width + gap - 1e-6
        and a.y < b.y + b.height + gap - 1e-6
        and b.y < a.y + a.height + gap - 1e-6
    )


def points(route: Route) -> list[tuple[float, float]]:
    """Many points along an arrow's line."""
    made, before = [], (route.path[0][1], route.path[0][2])
    for kind, x, y in route.path[1:]:
        for k in range(25):
            t = k / 24
            across, down = t, t
            if kind == "S":  # a Bezier curve whose middle points are at half the height
                across = 3 * t**2 - 2 * t**3
                down = 1.5 * (1 - t) * t + t**3
            made.append((before[0] + across * (x - before[0]), before[1] + down * (y - before[1])))
        before = (x, y)
    return made


def test_nothing_overlaps(drawn: list[Drawing]) -> None:
    """Boxes, flags and labels, and all of them are inside the picture."""
    for drawing in drawn:
        things = [*drawing.boxes, *drawing.flags, *drawing.labels]
        for a, b in itertools.combinations(things, 2):
            assert not overlap(a, b), (drawing.title, a, b)
        for thing in things:
            assert thing.x >= 0
            assert thing.x + thing.width <= drawing.width
            assert 40 < thing.y < thing.y + thing.height <= drawing.height
        assert TITLE_X + text_width(drawing.title, TITLE) <= drawing.width - TITLE_X


def test_no_arrow_crosses_a_box_or_another_label(drawn: list[Drawing]) -> None:
    """An arrow touches the boxes at its ends and its own label, nothing else."""
    for drawing in drawn:
        for route in drawing.routes:
            foreign = [
                p
                for p in [*drawing.boxes, *drawing.flags, *drawing.labels]
                if p.label is not route.arrow
            ]
            for x, y in points(route):
                assert 0 <= x <= drawing.width
                assert 0 <= y <= drawing.height
                for p in foreign:
                    inside = p.x + 1 < x < p.x + p.width - 1 and p.y + 1 < y < p.y + p.height - 1
                    assert not inside, (drawing.title, route.arrow, p)


def test_every_arrow_ends_at_its_node_or_a_flag_with_its_name(drawn: list[Drawing]) -> None:
    """The last point lies on the edge of what the arrow leads to, the first on its source."""
    for drawing in drawn:
        boxes = {p.box.name: p for p in drawing.boxes if p.box}
        for route in drawing.routes:
            _, x, y = route.path[0]
            at = boxes[route.arrow.source]
            assert at.x <= x <= at.x + at.width
            assert y in (pytest.approx(at.y), pytest.approx(at.y + at.height))
            _, x, y = route.path[-1]
            ends = [p for p in drawing.flags if p.flag == route.arrow.target]
            ends += [boxes[route.arrow.target]] if route.arrow.target in boxes else []
            assert any(
                p.x <= x <= p.x + p.width and min(abs(y - p.y), abs(y - p.y - p.height)) < 1e-6
                for p in ends
            )


def test_every_transition_is_in_the_picture() -> None:
    """All labels of all edges, each once for every pair of nodes."""
    made = chain(30, 4)
    drawing = draw(sketch(made, TYPES))
    arrows = [p.label for p in drawing.labels if p.label] + list(drawing.loops)
    shown = sorted((a.source, line, a.target) for a in arrows for line in a.lines)
    written = [(n.name, e, t) for n in made.nodes.values() for e, t in n.transitions.items()]
    written += [(n.name, g.text, g.target) for n in made.nodes.values() for g in n.guards]
    assert shown == sorted(written)


def test_a_picture_of_fifty_nodes_is_quick_and_about_as_wide_as_a_screen() -> None:
    """Less than a second; not a strip."""
    made = chain(50)
    start = time.process_time()
    drawing = draw(sketch(made, TYPES))
    assert time.process_time() - start < 1.0
    assert 0.7 < drawing.width / drawing.height < 3.0


def test_the_same_program_gives_the_same_picture() -> None:
    """To the byte, so that pictures can be kept under version control."""
    assert svg(chain(25), TYPES) == svg(chain(25), TYPES)


def groups(picture: str) -> dict[str, ElementTree.Element]:
    """Groups of nodes by the node's name."""
    root = ElementTree.fromstring(picture)
    return {g.attrib["data-node"]: g for g in root.iter(f"{NAMESPACE}g") if "data-node" in g.attrib}


def test_svg_marks_what_people_look_for(types: Registry, good: str) -> None:
    """Initial, terminal and current node; type and parameters; a warning in red."""
    text = good.replace("Mode = Soft;", "Mode = Soft; TRANSITION[Time > 9 s] = Rest1;")
    text = text.replace(
        "[Time > 9 s] = Rest1;", "[Time > 9 s] = Rest1; TRANSITION[Time > 12 s] = Rest1;"
    )
    made, findings = check_text(text, "x.hds", types)
    assert made is not None
    assert findings
    nodes = groups(svg(made, types, current="Line1"))
    assert [n for n, g in nodes.items() if "current" in g.attrib["class"].split()] == ["Line1"]
    assert [n for n, g in nodes.items() if "warning" in g.attrib["class"].split()] == ["Retract1"]
    assert [n for n, g in nodes.items() if g.find(f"{NAMESPACE}circle") is not None] == [
        "Approach1"
    ]
    inner = [n for n, g in nodes.items() if len(g.findall(f"{NAMESPACE}rect")) == 2]
    assert inner == ["Rest1"]
    words = [t.text for t in nodes["Line1"].iter(f"{NAMESPACE}text")]
    assert words[:3] == ["Line1", "Whiteboard_line", "Length = 50 mm"]


def test_names_are_escaped() -> None:
    """A guard's < and > do not break the picture."""
    picture = svg(chain(8, 2), TYPES)
    assert "Force &gt;" in picture
    ElementTree.fromstring(picture)


def test_a_refused_program_is_drawn_with_its_errors_in_red(types: Registry, good: str) -> None:
    """A missing node stands there as not declared; the arrow to it is red."""
    text = good.replace("TRANSITION[Contact] = Line1", "TRANSITION[Contact] = Line7")
    made, findings = check_text(text, "x.hds", types)
    assert made is None
    picture = render(broken_sketch(text, "x.hds", findings))
    nodes = groups(picture)
    assert "error" in nodes["Line7"].attrib["class"].split()
    assert "error" in nodes["Approach1"].attrib["class"].split()
    assert 'class="edge bad"' in picture
    assert "does not run" in picture


def test_a_declared_end_of_a_refused_program_is_drawn_as_one() -> None:
    """With its double edge, as in a program without errors."""
    text = "BEGIN NAME = Missed; TYPE = End; END BEGIN NAME = A; TYPE = Other; END"
    assert [box.terminal for box in broken_sketch(text, "x.hds", ()).boxes] == [True, False]


@pytest.mark.parametrize("cut", range(0, 700, 35))
def test_whatever_is_left_of_a_program_can_be_drawn(types: Registry, good: str, cut: int) -> None:
    """A file cut off anywhere, and with a piece missing."""
    for text in (good[:cut], good[cut:], good[:cut] + good[cut + 20 :]):
        _, findings = check_text(text, "x.hds", types)
        ElementTree.fromstring(render(broken_sketch(text, "x.hds", findings)))


def test_dot_and_mermaid_say_the_same() -> None:
    """Every arrow is in both."""
    made = sketch(chain(6), TYPES)
    assert dot(made).count(" -> ") == len(made.arrows) + 1
    assert mermaid(made).count("|") == 2 * len(made.arrows)
    assert 'fillcolor="#ffe9a8"' in dot(made, "N2")
    assert "class n2 current" in mermaid(made, "N2")


def test_layers_keep_items_apart_and_links_downwards() -> None:
    """The layout below the picture: each link goes one row down at a time."""
    widths = [40.0, 100.0, 30.0, 80.0, 60.0, 20.0]
    links = [(0, 1), (0, 2), (1, 3), (2, 3), (0, 4), (3, 4)]
    layers = layered(widths, links, 10.0)
    where = {id(s): r for r, row in enumerate(layers.rows) for s in row}
    for (a, b), slots in zip(links, layers.chains, strict=True):
        assert (slots[0].item, slots[-1].item) == (a, b)
        assert [where[id(s)] for s in slots] == list(
            range(where[id(slots[0])], where[id(slots[0])] + len(slots))
        )
    for row in layers.rows:
        for left, right in itertools.pairwise(row):
            assert right.x - left.x >= (left.width + right.width) / 2 + 10 - 1e-6
