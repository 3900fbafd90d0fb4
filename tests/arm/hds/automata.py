"""Made-up programs for tests: any automaton as a program of one node type, and random ones."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence

from arm.hds import END, Event, NodeType, Program, Quantity, check_text, registry
from arm.hds.program import Guard, Node

EVENTS = ("a", "b", "c")
TYPES = registry(
    NodeType("Work", events=tuple(Event(e) for e in EVENTS), quantities=(Quantity("Force", "N"),)),
    NodeType("Rest", events=(Event("a"),)),
    NodeType("Stop", terminal=True),
)

Table = Mapping[str, Mapping[str, str]]


def program(
    table: Table, types: Mapping[str, str] | None = None, guards: Sequence[tuple[str, Guard]] = ()
) -> Program:
    """A program from its transitions, first node first; every name that is no key is terminal."""
    kinds = dict(types or {})
    nodes = {
        name: Node(
            name,
            kinds.get(name, "Work" if row else "Stop"),
            {},
            row,
            not row,
            guards=tuple(g for at, g in guards if at == name),
        )
        for name, row in table.items()
    }
    return Program(nodes, next(iter(table)), "r1", "made.hds", "")


def random_table(seed: int, size: int = 5) -> dict[str, dict[str, str]]:
    """A random automaton: some nodes unreachable, some blocking, some terminal."""
    rng = random.Random(seed)
    names = [f"N{i}" for i in range(size)]
    table: dict[str, dict[str, str]] = {}
    for name in names:
        row = {e: rng.choice([*names, END.name]) for e in EVENTS if rng.random() < 0.5}
        table[name] = {} if rng.random() < 0.15 and name != "N0" else row
    table["N0"] = table["N0"] or {"a": rng.choice(names)}
    return table


def source(size: int, seed: int = 1) -> str:
    """The text of a program of ``size`` nodes as people write them: a chain with ways aside."""
    rng = random.Random(seed)
    text = ["INTERFACE = r1;", "INITIAL = N0;", "ABORT = Rest1;"]
    for i in range(size - 1):
        onward = f"N{i + 1}" if i < size - 2 else END.name
        other = rng.choice([END.name, "Rest1", f"N{i}", f"N{rng.randrange(size - 1)}"])
        third = rng.choice([END.name, "Rest1", "Rest1", f"N{rng.randrange(size - 1)}"])
        text += ["BEGIN", f"NAME = N{i};", "TYPE = Work;"]
        text += [f"TRANSITION[a] = {onward};", f"TRANSITION[b] = {other};"]
        text += [f"TRANSITION[c] = {third};"]
        if rng.random() < 0.5:
            text += [f"TRANSITION[Force > {rng.randrange(2, 9)} N] = Rest1;"]
        text += ["END"]
    text += ["BEGIN", "NAME = Rest1;", "TYPE = Rest;", "TRANSITION[a] = End;", "END"]
    return "\n".join(text)


def chain(size: int, seed: int = 1) -> Program:
    """That program, checked."""
    made, findings = check_text(source(size, seed), f"chain{size}.hds", TYPES)
    assert made is not None, findings
    return made
