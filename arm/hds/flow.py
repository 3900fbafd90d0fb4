"""What the nodes say together: where the program can go from where."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from arm.hds.finding import Report
from arm.hds.nodetype import Registry
from arm.hds.program import END
from arm.hds.semantics import NodeCheck
from arm.hds.syntax import Block

Edges = Mapping[str, Iterable[str]]


def check_flow(
    checked: Mapping[str, NodeCheck],
    blocks: Mapping[str, Block],
    initial: str | None,
    types: Registry,
    report: Report,
) -> None:
    """Check reachability, ways to an end, and that time passes in every cycle.

    A node that is broken in another way gets the benefit of the doubt: its own finding says what
    to mend, and what else is wrong shows once it is mended.

    Args:
        checked: nodes by name.
        blocks: the same nodes as written.
        initial: name of the initial node; None if that is not known.
        types: the node types there are.
        report: where findings go.
    """
    edges = {name: check.ways for name, check in checked.items()}
    broken = {name for name, check in checked.items() if not check.certain}
    terminals = {END.name} | {name for name, check in checked.items() if check.node.terminal}
    instant = {
        name
        for name, check in checked.items()
        if check.node.type in types
        and not types[check.node.type].takes_time
        and not check.node.terminal
    }
    _unreachable(edges, blocks, initial, broken, report)
    _no_end(edges, blocks, terminals | broken, report)
    _timeless(
        {name: [t for t in edges[name] if t in instant] for name in edges if name in instant},
        blocks,
        report,
    )


def _reached(edges: Edges, starts: Iterable[str]) -> set[str]:
    seen = set(starts)
    waiting = list(seen)
    while waiting:
        for target in edges.get(waiting.pop(), ()):
            if target not in seen:
                seen.add(target)
                waiting.append(target)
    return seen


def _unreachable(
    edges: Edges,
    blocks: Mapping[str, Block],
    initial: str | None,
    broken: set[str],
    report: Report,
) -> None:
    if initial is None:
        return
    seen = _reached(edges, [initial])
    if seen & broken:
        return
    for name, block in blocks.items():
        if name not in seen:
            message = f"no way leads from '{initial}' to the node '{name}'"
            report.warning("unreachable-node", message, block.place)


def _no_end(edges: Edges, blocks: Mapping[str, Block], ends: set[str], report: Report) -> None:
    back: dict[str, list[str]] = {}
    for source, targets in edges.items():
        for target in targets:
            back.setdefault(target, []).append(source)
    good = _reached(back, ends)
    for name, block in blocks.items():
        if name not in good:
            message = f"no way leads from the node '{name}' to an end of the program"
            report.error("no-way-to-end", message, block.place, "some transition must lead to End")


def _timeless(edges: Edges, blocks: Mapping[str, Block], report: Report) -> None:
    told: set[str] = set()
    for name in edges:
        cycle = None if name in told else _cycle(edges, name)
        if cycle:
            told.update(cycle)
            way = " -> ".join([*cycle, name])
            report.error(
                "zero-time-cycle",
                f"no time need pass on the way {way}",
                blocks[name].place,
                "put a node that takes time into the cycle",
            )


def _cycle(edges: Edges, start: str) -> list[str]:
    """A shortest way from ``start`` back to itself, without its end; empty if there is none."""
    came_from: dict[str, str] = {}
    waiting = [start]
    for name in waiting:
        for target in edges[name]:
            if target == start:
                way = [name]
                while way[-1] != start:
                    way.append(came_from[way[-1]])
                return way[::-1]
            if target not in came_from:
                came_from[target] = name
                waiting.append(target)
    return []
