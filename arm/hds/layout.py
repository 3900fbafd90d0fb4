"""Layered layout of a graph without cycles: rows, order in the rows, and places along them.

The layers and the order that makes few crossings are grandalf's (Sugiyama); what stands side by
side is then kept apart, and long links are straightened, here. Knows nothing of programs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from grandalf.graphs import Edge, Graph, Vertex
from grandalf.layouts import SugiyamaLayout

_ROUNDS = 16
_STIFF = 4.0
"""How much more a link that passes a row wants to be straight than an item wants its place."""


@dataclass(eq=False)
class Slot:
    """A place in a row.

    Attributes:
        item: number of the item there; None where a link passes.
        width: of the item, 0 for a passing link.
        x: middle.
        above: the slots of the row above it is linked with.
        below: and of the row below.
        weight: how much its place counts: most for what has most below it, so that the main way
            through a program is straight and what branches off stands aside.
    """

    item: int | None
    width: float
    x: float = 0.0
    above: list[Slot] = field(default_factory=list)
    below: list[Slot] = field(default_factory=list)
    weight: float = 1.0


@dataclass(frozen=True)
class Layers:
    """Rows from top to bottom, each from left to right.

    Attributes:
        rows: the slots.
        chains: for every link the slots from its source to its target, one a row.
    """

    rows: list[list[Slot]]
    chains: list[list[Slot]]


class _View:
    """What grandalf needs to know of a vertex."""

    def __init__(self, width: float) -> None:
        self.w, self.h = width, 1.0
        self.xy = (0.0, 0.0)


def layered(
    widths: Sequence[float], links: Sequence[tuple[int, int]], gap: float, low: Iterable[int] = ()
) -> Layers:
    """Lay out items so that every link leads downwards.

    Args:
        widths: of the items.
        links: pairs of numbers of items, source and target; no cycle, no pair twice.
        gap: least distance of what stands side by side.
        low: items with one link on either side that go as far down as their links allow.
    """
    rows: list[list[Slot]] = []
    slots: dict[int, Slot] = {}
    passing: dict[tuple[int, int], list[Slot]] = {}
    for sugiyama in _components(widths, links, gap):
        made = {}
        for rank, layer in enumerate(sugiyama.layers):
            rows += [[]] if rank == len(rows) else []
            for vertex in layer:
                item = getattr(vertex, "data", None)
                slot = Slot(item, 0.0 if item is None else widths[item], vertex.view.xy[0])
                made[vertex] = slot
                rows[rank].append(slot)
                if item is not None:
                    slots[item] = slot
        for edge, ctrl in sugiyama.ctrls.items():
            pair = (edge.v[0].data, edge.v[1].data)
            passing[pair] = [made[ctrl[rank]] for rank in sorted(ctrl)[1:-1]]
    chains = [[slots[a], *passing.get((a, b), []), slots[b]] for a, b in links]
    for chain in chains:
        for upper, lower in pairwise(chain):
            upper.below.append(lower)
            lower.above.append(upper)
    for item in low:
        slots[item] = _sink(slots[item])
    _straighten(rows, gap)
    return Layers(rows, chains)


def _sink(slot: Slot) -> Slot:
    """Change places with what passes the rows below; returns the slot where the item is then."""
    while slot.below[0].item is None:
        lower = slot.below[0]
        slot.item, lower.item = lower.item, slot.item
        slot.width, lower.width = lower.width, slot.width
        slot = lower
    return slot


def _components(
    widths: Sequence[float], links: Sequence[tuple[int, int]], gap: float
) -> Iterator[SugiyamaLayout]:
    """grandalf's layout of each connected part, that of the first item first."""
    vertices = [Vertex(number) for number in range(len(widths))]
    for vertex, width in zip(vertices, widths, strict=True):
        vertex.view = _View(width)
    graph = Graph(vertices, [Edge(vertices[a], vertices[b]) for a, b in links])
    for core in sorted(graph.C, key=lambda core: min(v.data for v in core.sV)):
        sugiyama = SugiyamaLayout(core)
        sugiyama.dw, sugiyama.xspace = 1.0, gap
        roots = sorted((v for v in core.sV if not v.e_in()), key=lambda v: v.data)
        sugiyama.init_all(roots=roots, inverted_edges=[])
        sugiyama.draw(3.5)
        yield sugiyama


def _straighten(rows: list[list[Slot]], gap: float) -> None:
    """Move every slot towards those it is linked with, keeping order and distances."""
    for row in rows[::-1]:
        for slot in row:
            deep = max((lower.weight for lower in slot.below), default=0.0)
            slot.weight = deep + (0.0 if slot.item is None else 1.0)
    for row in rows:
        for slot in row:
            slot.weight = max(slot.weight, 0.5) ** 2 * (_STIFF if slot.item is None else 1.0)
        apart(row, [slot.x for slot in row], gap)
    for turn in range(_ROUNDS):
        down = turn % 2 == 0
        for row in rows if down else rows[::-1]:
            wanted = []
            for slot in row:
                near = (slot.above if down else slot.below) or [slot]
                total = sum(other.weight for other in near)
                wanted.append(sum(other.x * other.weight for other in near) / total)
            apart(row, wanted, gap)


def apart(row: Sequence[Slot], wanted: Sequence[float], gap: float) -> None:
    """Nearest to ``wanted`` with order and distances kept (least squares, pool adjacent)."""
    offsets = [0.0]
    for left, right in pairwise(row):
        offsets.append(offsets[-1] + (left.width + right.width) / 2 + gap)
    blocks: list[tuple[float, float, int]] = []  # weighted sum, weight, how many
    for slot, want, offset in zip(row, wanted, offsets, strict=True):
        blocks.append(((want - offset) * slot.weight, slot.weight, 1))
        while len(blocks) > 1 and blocks[-2][0] / blocks[-2][1] > blocks[-1][0] / blocks[-1][1]:
            last = blocks.pop()
            before = blocks.pop()
            blocks.append((before[0] + last[0], before[1] + last[1], before[2] + last[2]))
    places = [total / weight for total, weight, number in blocks for _ in range(number)]
    for slot, place, offset in zip(row, places, offsets, strict=True):
        slot.x = place + offset
