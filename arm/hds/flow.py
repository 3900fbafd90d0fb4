"""What the nodes say together: where the program can go from where."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from arm.hds.analysis import closure
from arm.hds.finding import Report
from arm.hds.nodecheck import NodeCheck
from arm.hds.program import END

Edges = Mapping[str, Iterable[str]]


def check_flow(
    checked: Mapping[str, NodeCheck],
    initial: str | None,
    abort: str | None,
    partial: bool,
    report: Report,
) -> None:
    """Check reachability, ways to an end, and that time passes in every cycle.

    A node that is broken in another way gets the benefit of the doubt: its own finding says what
    to mend, and what else is wrong shows once it is mended. An abort leads to nodes, but is no
    way of the program to its end. A guard is looked at a tick after its node was entered, so time
    passes on its way.

    Args:
        checked: nodes by name.
        initial: name of the initial node; None if that is not known.
        abort: name of the node an abort leads to; None if that is not known.
        partial: whether there may be nodes that could not be read.
        report: where findings go.
    """
    edges = {name: check.ways for name, check in checked.items()}
    broken = {name for name, check in checked.items() if not check.certain}
    terminals = {END.name} | {name for name, check in checked.items() if check.terminal}
    instant = {
        name
        for name, check in checked.items()
        if check.type is not None and not check.type.takes_time and not check.terminal
    }
    if initial is not None and abort is not None and not partial:
        _unreachable(edges, checked, initial, abort, broken, report)
    _no_end(edges, checked, terminals | broken, report)
    at_once = {n: [t for t in c.raised if t in instant] for n, c in checked.items() if n in instant}
    _timeless(at_once, checked, report)


def _unreachable(
    edges: Edges,
    checked: Mapping[str, NodeCheck],
    initial: str,
    abort: str,
    broken: set[str],
    report: Report,
) -> None:
    seen = closure(edges, [initial, abort])
    if seen & broken:
        return
    # what others are like, and what a file offers to those that include it, need not run itself
    patterns = {check.block.likes[0].text for check in checked.values() if check.block.likes}
    for name, check in checked.items():
        place = check.block.place
        if name not in seen and name not in patterns and not place.file:
            message = f"no way leads from '{initial}' to the node '{name}'"
            report.warning("unreachable-node", message, place)


def _no_end(edges: Edges, checked: Mapping[str, NodeCheck], ends: set[str], report: Report) -> None:
    back: dict[str, list[str]] = {}
    for source, targets in edges.items():
        for target in targets:
            back.setdefault(target, []).append(source)
    good = closure(back, ends)
    for name, check in checked.items():
        if name not in good:
            message = f"no way leads from the node '{name}' to an end of the program"
            report.error(
                "no-way-to-end", message, check.block.place, "some transition must lead to End"
            )


def _timeless(edges: Edges, checked: Mapping[str, NodeCheck], report: Report) -> None:
    told: set[str] = set()
    for name in edges:
        cycle = None if name in told else _cycle(edges, name)
        if cycle:
            told.update(cycle)
            way = " -> ".join([*cycle, name])
            report.error(
                "zero-time-cycle",
                f"no time need pass on the way {way}",
                checked[name].block.place,
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
