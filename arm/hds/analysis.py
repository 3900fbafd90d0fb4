"""What the discrete part of a program can do: pure functions of A = (Q, E, delta, T, mu).

Abort edges lead out of every node at any time. They count for what can be reached; what leads to
an end, and what repeats, is judged without them, or every program would look free of blocking.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from arm.hds.discrete import Discrete, Edge
from arm.hds.guards import implies
from arm.hds.program import Guard, Program

Ways = Mapping[str, Iterable[str]]


def closure(ways: Ways, starts: Iterable[str]) -> set[str]:
    """Every node some way leads to from ``starts``, these included."""
    seen = set(starts)
    waiting = list(seen)
    while waiting:
        for target in ways.get(waiting.pop(), ()):
            if target not in seen:
                seen.add(target)
                waiting.append(target)
    return seen


def reachable(automaton: Discrete) -> set[str]:
    """The nodes the program can be in, abort included."""
    return closure(automaton.ways(), [automaton.initial])


def coreachable(automaton: Discrete) -> set[str]:
    """The nodes from which some way leads to a terminal node without abort."""
    back: dict[str, list[str]] = {}
    for source, targets in automaton.ways(abort=False).items():
        for target in targets:
            back.setdefault(target, []).append(source)
    return closure(back, automaton.terminals)


def blocking(automaton: Discrete) -> set[str]:
    """Nodes the program can be in and cannot end from: empty for a non-blocking program."""
    return reachable(automaton) - coreachable(automaton)


def shortest_way(automaton: Discrete) -> list[Edge] | None:
    """Fewest edges from the initial node to a terminal one; None if no way leads to an end."""
    came: dict[str, Edge] = {}
    waiting = [automaton.initial]
    for name in waiting:
        if name in automaton.terminals:
            way: list[Edge] = []
            while name != automaton.initial:
                way.append(came[name])
                name = way[-1].source
            return way[::-1]
        for edge in automaton.out(name):
            fresh = edge.target not in came and edge.target != automaton.initial
            if edge.possible and edge.kind != "abort" and fresh:
                came[edge.target] = edge
                waiting.append(edge.target)
    return None


def longest_way(automaton: Discrete) -> int | None:
    """Most edges from the initial node to a terminal one; None if a cycle makes it unbounded.

    Only nodes that are on a way from the initial to a terminal node count. It is 0 when there is
    none, or when the initial node is terminal.
    """
    ways = automaton.ways(abort=False)
    good = closure(ways, [automaton.initial]) & coreachable(automaton)
    inside = {name: [t for t in ways[name] if t in good] for name in good}
    if any(_is_cycle(part, inside) for part in components(inside)):
        return None
    length: dict[str, int] = {}
    for part in components(inside):  # every target before its sources
        (name,) = part
        length[name] = max((length[t] + 1 for t in inside[name]), default=0)
    return length.get(automaton.initial, 0)


def cycles(automaton: Discrete) -> list[list[str]]:
    """Groups of nodes that can follow each other for ever, each in the order of the source."""
    ways = automaton.ways(abort=False)
    order = {name: i for i, name in enumerate(automaton.nodes)}
    found = [sorted(part, key=order.__getitem__) for part in components(ways)]
    found = [part for part in found if _is_cycle(part, ways)]
    return sorted(found, key=lambda part: order[part[0]])


def _is_cycle(part: list[str], ways: Ways) -> bool:
    return len(part) > 1 or part[0] in ways.get(part[0], ())


def components(ways: Ways) -> list[list[str]]:
    """Strongly connected components, each after all those it leads to (Tarjan, no recursion)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    on_stack: set[str] = set()
    found: list[list[str]] = []
    for root in ways:
        if root in index:
            continue
        work = [(root, iter(ways[root]))]
        index[root] = low[root] = len(index)
        stack.append(root)
        on_stack.add(root)
        while work:
            name, targets = work[-1]
            for target in targets:
                if target not in index:
                    index[target] = low[target] = len(index)
                    stack.append(target)
                    on_stack.add(target)
                    work.append((target, iter(ways.get(target, ()))))
                    break
                if target in on_stack:
                    low[name] = min(low[name], index[target])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[name])
                if low[name] == index[name]:
                    part = [stack.pop()]
                    while part[-1] != name:
                        part.append(stack.pop())
                    on_stack.difference_update(part)
                    found.append(part)
    return found


@dataclass(frozen=True)
class Conflict:
    """Two transitions of one node that can be due in the same tick, and what then happens.

    Attributes:
        node: the node.
        first: the one that is taken.
        second: the other one.
        rule: the rule that decides.
        never: the second one can never be taken, because the first holds whenever it does.
    """

    node: str
    first: str
    second: str
    rule: str
    never: bool = False


EVENT_FIRST = "an event comes before every guard"
TEXT_ORDER = "the guard that stands first in the program is taken"


def conflicts(program: Program) -> list[Conflict]:
    """Transitions that can be due at once; the rules make the program deterministic all the same.

    A node's controller raises at most one event a tick, so events never meet each other.
    """
    found: list[Conflict] = []
    for node in program.nodes.values():
        for guard in node.guards:
            for event in node.transitions:
                found.append(Conflict(node.name, event, guard.text, EVENT_FIRST))
        for i, first in enumerate(node.guards):
            for second in node.guards[i + 1 :]:
                if overlap(first, second):
                    never = implies(second, first)
                    found.append(Conflict(node.name, first.text, second.text, TEXT_ORDER, never))
    return found


def overlap(a: Guard, b: Guard) -> bool:
    """Whether two guards can hold at once; guards on different quantities always can."""
    if a.quantity != b.quantity or _upward(a) == _upward(b):
        return True
    low, high = (a, b) if _upward(a) else (b, a)
    if "=" in low.operator and "=" in high.operator:
        return low.limit <= high.limit
    return low.limit < high.limit


def _upward(guard: Guard) -> bool:
    return guard.operator.startswith(">")
