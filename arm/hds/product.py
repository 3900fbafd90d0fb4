"""Synchronous product of a program with a specification: does the program ever leave it?

After Ramadge and Wonham, the specification is an automaton over what happens in the program. Both
run in step; what a state of the specification does not mention leaves it where it is, and what it
sends to ``Forbidden`` must not happen. One step of the program happens in two parts: first what
its node raises, then which node is entered.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from arm.hds.discrete import Discrete, Edge, discrete
from arm.hds.nodetype import Registry
from arm.hds.program import Program
from arm.hds.specification import ENTERED, FORBIDDEN, Happening, Rule, Specification


@dataclass(frozen=True)
class Violation:
    """The shortest way out of the specification.

    Attributes:
        trace: the program's edges from its start; empty if starting is already forbidden.
        states: state of the specification before the first edge and after each but the last.
        rule: the rule of the specification that forbids what happens last.
    """

    trace: tuple[Edge, ...]
    states: tuple[str, ...]
    rule: Rule


@dataclass(frozen=True)
class Verdict:
    """What the product says.

    Attributes:
        violation: a shortest one; None if the program never leaves the specification.
        pairs: pairs of a node and a state of the specification that can be at once.
        unreached: states of the specification that the program never brings about; a
            specification is empty talk in as far as it stands there.
    """

    violation: Violation | None
    pairs: frozenset[tuple[str, str]]
    unreached: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether the program never leaves the specification."""
        return self.violation is None


def verify(automaton: Discrete, types: Mapping[str, str], spec: Specification) -> Verdict:
    """Walk the product breadth first, abort edges included, events that cannot happen not.

    Args:
        automaton: the discrete part of the program.
        types: name of each node's type, ``End`` included if something leads there.
        spec: the specification.
    """

    def entered(state: str, node: str) -> tuple[str, Rule | None]:
        return spec.step(state, Happening(ENTERED, node, types[node]))

    def taken(state: str, edge: Edge) -> tuple[str, Rule | None]:
        raised = Happening(edge.symbol, edge.source, types[edge.source])
        state, rule = spec.step(state, raised)
        return (state, rule) if state == FORBIDDEN else entered(state, edge.target)

    state, rule = entered(spec.initial, automaton.initial)
    if state == FORBIDDEN:
        assert rule is not None
        return Verdict(Violation((), (), rule), frozenset(), ())
    start = (automaton.initial, state)
    came: dict[tuple[str, str], tuple[tuple[str, str], Edge] | None] = {start: None}
    waiting = [start]
    violation: Violation | None = None
    for pair in waiting:
        for edge in automaton.out(pair[0]):
            if not edge.possible:
                continue
            after, rule = taken(pair[1], edge)
            if after == FORBIDDEN:
                if violation is None:
                    assert rule is not None
                    violation = _violation(came, pair, edge, rule)
                continue
            following = (edge.target, after)
            if following not in came:
                came[following] = (pair, edge)
                waiting.append(following)
    reached = {state for _, state in came} | {spec.initial}
    unreached = tuple(name for name in spec.states if name not in reached)
    return Verdict(violation, frozenset(came), unreached)


def _violation(
    came: dict[tuple[str, str], tuple[tuple[str, str], Edge] | None],
    pair: tuple[str, str],
    last: Edge,
    rule: Rule,
) -> Violation:
    trace, states = [last], [pair[1]]
    step = came[pair]
    while step is not None:
        pair, edge = step
        trace.append(edge)
        states.append(pair[1])
        step = came[pair]
    return Violation(tuple(trace[::-1]), tuple(states[::-1]), rule)


def verify_program(
    program: Program, registry: Registry, spec: Specification, abort: bool = True
) -> Verdict:
    """The verdict on a checked program; ``abort`` False leaves out that Abort may happen."""
    automaton = discrete(program, registry)
    if not abort:
        edges = tuple(edge for edge in automaton.edges if edge.kind != "abort")
        automaton = replace(automaton, edges=edges)
    return verify(automaton, {name: program.node(name).type for name in automaton.nodes}, spec)


def render_verdict(program: Program, spec: Specification, verdict: Verdict) -> str:
    """What people read: that it holds, or the shortest trace out of the specification."""
    if verdict.violation is None:
        lines = [f"{program.path} never leaves {spec.path}"]
        lines += [
            f"note: the program never brings '{name}' about; its rules say nothing here"
            for name in verdict.unreached
        ]
        return "\n".join(lines)
    found = verdict.violation
    where = f"{spec.path}:{found.rule.line}"
    what = ", ".join(str(symbol) for symbol in found.rule.symbols)
    lines = [f"{where}: {program.path} leaves the specification: {what} is forbidden there"]
    rows = [
        (f"{edge.source} -[{edge.label}]-> {edge.target}", f"in state {state}")
        for edge, state in zip(found.trace, found.states, strict=True)
    ] or [(f"start in {program.initial}", f"in state {spec.initial}")]
    width = max(len(row[0]) for row in rows)
    lines += [f"  {i}. {a.ljust(width)}  {b}" for i, (a, b) in enumerate(rows, 1)]
    return "\n".join(lines)
