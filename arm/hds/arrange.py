"""Gives every item of a picture its place and every arrow its line."""

from __future__ import annotations

from collections.abc import Sequence

from arm.hds.drawing import (
    GAP,
    GUTTER,
    MARGIN,
    PAD,
    PORT,
    ROW,
    TITLE,
    TITLE_X,
    TOP,
    TRACK,
    Drawing,
    Placed,
    Route,
    text_width,
)
from arm.hds.fold import Column, Row, fold
from arm.hds.layout import Layers, Slot, apart, layered
from arm.hds.placing import Plan, plan
from arm.hds.sketch import Sketch

Path = list[tuple[str, float, float]]


def draw(sketch: Sketch) -> Drawing:
    """The drawing of a sketch."""
    if not sketch.boxes:
        return Drawing(sketch.title, _least(sketch), TOP + MARGIN, (), (), (), (), ())
    planned = plan(sketch)
    widths = [item.width + 2 * item.beside for item in planned.items]
    labels = [planned.links[upper][1] for _, upper, _, up in planned.ways if up]
    layers = layered(widths, planned.links, GAP, labels)
    heights = {number: item.height for number, item in enumerate(planned.items)}
    columns = fold(layers.rows, heights)
    placed: dict[int, Placed] = {}
    for column in columns:
        for row in column.rows:
            for slot in row.slots:
                if slot.item is not None:
                    placed[slot.item] = _placed(planned, slot, row)
    things = list(placed.values())
    depth = max(row.bottom + column.crossing * TRACK for column in columns for row in column.rows)
    return Drawing(
        sketch.title,
        max(columns[-1].right + MARGIN, _least(sketch)),
        depth + ROW + MARGIN,
        tuple(p for p in things if p.box),
        tuple(p for p in things if p.flag),
        tuple(p for p in things if p.label),
        tuple(_routes(planned, layers, columns, placed)),
        tuple(planned.loops),
    )


def _least(sketch: Sketch) -> float:
    """The width that the title takes, and a picture does not go below [px]."""
    return max(2.0 * TITLE_X + text_width(sketch.title, TITLE), 320.0)


def _placed(planned: Plan, slot: Slot, row: Row) -> Placed:
    assert slot.item is not None
    item = planned.items[slot.item]
    x, y = slot.x - item.width / 2, row.y + (row.height - item.height) / 2
    return Placed(x, y, item.width, item.height, item.box, item.flag, item.label)


def _routes(
    planned: Plan, layers: Layers, columns: list[Column], placed: dict[int, Placed]
) -> list[Route]:
    """A line for every arrow: upright through rows, curved between them, around columns."""
    where = {
        id(slot): (number, row)
        for number, column in enumerate(columns)
        for row in column.rows
        for slot in row.slots
    }
    ports = _ports(planned, layers)
    used = [0] * len(columns)
    routes = []
    for arrow, upper, lower, up in planned.ways:
        chain = layers.chains[upper] + layers.chains[lower][1:]
        top, bottom = placed[planned.links[upper][0]], placed[planned.links[lower][1]]
        x = chain[0].x + ports[upper, "out"]
        number, row = where[id(chain[0])]
        path: Path = [("M", x, top.y + top.height), ("L", x, row.bottom)]
        for slot in chain[1:]:
            last = slot is chain[-1]
            x = slot.x + (ports[lower, "in"] if last else 0.0)
            before, (number, row) = number, where[id(slot)]
            if before != number:
                used[before] += 1
                path += _around(columns[before], path[-1][1], x, row.y, used[before])
            else:
                path.append(("S", x, row.y))
            path.append(("L", x, bottom.y if last else row.bottom))
        routes.append(Route(arrow, _turned(path) if up else tuple(path), up))
    return routes


def _around(column: Column, x: float, to: float, y: float, track: int) -> Path:
    """From the foot of a column to the head of the next."""
    low = column.rows[-1].bottom + ROW / 2 + track * TRACK
    high = y - ROW / 2 - track * TRACK
    aside = column.right + GUTTER / 2 + track * TRACK
    return [("L", x, low), ("L", aside, low), ("L", aside, high), ("L", to, high), ("L", to, y)]


def _turned(path: Sequence[tuple[str, float, float]]) -> tuple[tuple[str, float, float], ...]:
    """The same line from its other end."""
    kinds = ["M", *(kind for kind, _, _ in reversed(path[1:]))]
    return tuple((kind, x, y) for kind, (_, x, y) in zip(kinds, reversed(path), strict=True))


def _ports(planned: Plan, layers: Layers) -> dict[tuple[int, str], float]:
    """How far from a box's middle each link leaves or arrives: as straight as there is room."""
    ends: dict[tuple[int, str], list[tuple[Slot, Slot, int]]] = {}
    for number, (upper, lower) in enumerate(planned.links):
        chain = layers.chains[number]
        ends.setdefault((upper, "out"), []).append((chain[0], chain[1], number))
        ends.setdefault((lower, "in"), []).append((chain[-1], chain[-2], number))
    ports = {}
    for (item, side), links in ends.items():
        links.sort(key=lambda link: link[1].x)
        room = planned.items[item].width / 2 - PAD
        wanted = [max(-room, min(room, other.x - box.x)) for box, other, _ in links]
        if planned.items[item].flag:
            wanted = [0.0]
        places = [Slot(None, 0.0, weight=other.weight) for _, other, _ in links]
        apart(places, wanted, min(PORT, 2 * room / max(1, len(links) - 1)))
        for place, (_, _, number) in zip(places, links, strict=True):
            ports[number, side] = max(-room, min(room, place.x))
    return ports
