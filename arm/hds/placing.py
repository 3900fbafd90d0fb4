"""Which items a picture has and how they hang together: boxes, labels, flags, and no cycle."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from arm.hds.drawing import FAR, FLAG, HUB, LINE, LOOP, NAME, PAD, START, TEXT, text_width
from arm.hds.program import END
from arm.hds.sketch import Arrow, Box, Sketch


@dataclass
class Item:
    """Something with a size: a box, the label of an arrow, or a flag at the end of one.

    Attributes:
        width: of what is drawn [px].
        height: of what is drawn [px].
        beside: room kept free on both sides [px].
        box: what it is, or
        label: what it is, or
        flag: name of the node the flag stands for.
    """

    width: float
    height: float
    beside: float = 0.0
    box: Box | None = None
    label: Arrow | None = None
    flag: str = ""


@dataclass
class Plan:
    """Items and links without cycle.

    Attributes:
        items: all of them.
        links: pairs of items, downwards.
        ways: for every arrow that is laid out its two links, and whether it points upwards.
        loops: arrows from a node to itself.
    """

    items: list[Item] = field(default_factory=list)
    links: list[tuple[int, int]] = field(default_factory=list)
    ways: list[tuple[Arrow, int, int, bool]] = field(default_factory=list)
    loops: list[Arrow] = field(default_factory=list)


def plan(sketch: Sketch) -> Plan:
    """Items and links of a sketch."""
    made = Plan()
    loops = {a.source: a for a in sketch.arrows if a.source == a.target}
    made.loops = list(loops.values())
    numbers: dict[str, int] = {}
    for box in sketch.boxes:
        if box.name != END.name:
            numbers[box.name] = len(made.items)
            made.items.append(_box(box, loops.get(box.name)))
    arrows = [a for a in sketch.arrows if a.source != a.target]
    tree, upwards, depth = _explore(sketch, arrows)
    into = Counter(arrow.target for arrow in arrows)
    for number, arrow in enumerate(arrows):
        far = abs(depth[arrow.target] - depth[arrow.source])
        hub = into[arrow.target] >= HUB and far > 1
        flagged = arrow.target not in numbers or (number not in tree and (far > FAR or hub))
        label = _add(made, _label(arrow))
        source = numbers[arrow.source]
        if flagged:
            flag = Item(text_width(arrow.target, TEXT) + 2 * PAD, FLAG, flag=arrow.target)
            target = _add(made, flag)
        else:
            target = numbers[arrow.target]
        up = number in upwards and not flagged
        ends = (target, source) if up else (source, target)
        made.ways.append((arrow, len(made.links), len(made.links) + 1, up))
        made.links += [(ends[0], label), (label, ends[1])]
    return made


def _add(made: Plan, item: Item) -> int:
    made.items.append(item)
    return len(made.items) - 1


def _box(box: Box, loop: Arrow | None) -> Item:
    lines = [box.type, *box.lines, *finding_lines(box)]
    width = max([text_width(box.name, NAME, True), *(text_width(line, TEXT) for line in lines)])
    height = 1.5 * PAD + NAME + LINE * len([line for line in lines if line])
    beside = START if box.initial else 0.0
    if loop is not None:
        beside = max(beside, LOOP + _label(loop).width)
    return Item(width + 2 * PAD, height, beside, box=box)


def finding_lines(box: Box) -> list[str]:
    """What a box says about its findings, each code once."""
    return list(dict.fromkeys(f"{f.severity}: {f.code}" for f in box.findings))


def _label(arrow: Arrow) -> Item:
    width = max(text_width(line, TEXT) for line in arrow.lines) + 8.0
    return Item(width, LINE * len(arrow.lines) + 2.0, label=arrow)


def _explore(sketch: Sketch, arrows: list[Arrow]) -> tuple[set[int], set[int], dict[str, int]]:
    """Walk depth first from the initial node, then from what it does not reach.

    Returns:
        Numbers of the arrows that found a node, of those that close a cycle, and for each node
        the most boxes above it when the latter are turned round.
    """
    out: dict[str, list[int]] = {box.name: [] for box in sketch.boxes}
    for number, arrow in enumerate(arrows):
        out[arrow.source].append(number)
    tree: set[int] = set()
    upwards: set[int] = set()
    opened: set[str] = set()
    closed: list[str] = []
    for start in sorted(sketch.boxes, key=lambda box: not box.initial):
        if start.name in opened:
            continue
        opened.add(start.name)
        work = [(start.name, iter(out[start.name]))]
        while work:
            name, numbers = work[-1]
            for number in numbers:
                target = arrows[number].target
                if target not in opened:
                    tree.add(number)
                    opened.add(target)
                    work.append((target, iter(out[target])))
                    break
                if target not in closed:
                    upwards.add(number)
            else:
                closed.append(name)
                work.pop()
    depth = dict.fromkeys(out, 0)
    for name in reversed(closed):
        for number in out[name]:
            target = arrows[number].target
            if number not in upwards:
                depth[target] = max(depth[target], depth[name] + 1)
    return tree, upwards, depth
