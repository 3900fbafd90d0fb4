"""Good programs broken at random, checked, and run if they pass.

    FUZZ=10000 python -m pytest -s tests/arm/hds/test_hds_mutations.py -k of_good

judges 10 000 mutants instead of a few hundred and prints what became of them; SEED=2 for others.
"""

from __future__ import annotations

import math
import random
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from arm.hds import Automaton, NodeType, Program, Registry, check_text, render
from arm.hds.parser import grammar
from arm.nodes import REGISTRY
from tests.arm.hds.made_up import TYPES

HERE = Path(__file__).parent
GOOD: list[tuple[Path, Registry]] = [
    *((path, TYPES) for path in sorted((HERE / "corpus" / "good").glob("*.hds"))),
    (HERE.parents[2] / "arm" / "programs" / "paper_fragment.hds", REGISTRY),
]
"""Programs without findings, and the types they are written for."""

TOKEN = re.compile(r'%[^\n]*|"[^"\n]*"|\w+|\s+|.')
OPERATIONS = ("delete", "duplicate", "swap")


def mutate(pieces: list[str], operation: str, where: int, other: int) -> list[str]:
    """One piece deleted, doubled at another place, swapped with or replaced by another."""
    pieces = list(pieces)
    i, j = where % len(pieces), other % len(pieces)
    if operation == "delete":
        del pieces[i]
    elif operation == "duplicate":
        pieces.insert(j, pieces[i])
    elif operation == "swap":
        pieces[i], pieces[j] = pieces[j], pieces[i]
    else:
        pieces[i] = pieces[j]
    return pieces


def mutants(count: int, seed: int) -> Iterator[tuple[str, Path, Registry]]:
    """Texts one token or line away from a good program, each with its file and types."""
    rng = random.Random(seed)
    for _ in range(count):
        path, types = rng.choice(GOOD)
        text = path.read_text(encoding="utf-8")
        lines = rng.random() < 0.5
        pieces = text.splitlines(keepends=True) if lines else TOKEN.findall(text)
        places = [i for i, piece in enumerate(pieces) if piece.strip()]
        operation, i, j = rng.choice(OPERATIONS), rng.choice(places), rng.choice(places)
        yield "".join(mutate(pieces, operation, i, j)), path, types


def judge(text: str, filename: str, types: Registry, seed: int) -> bool:
    """Check a text whatever it is, and run it if it passes; whether it passed.

    Raises:
        AssertionError: a finding without a place, or a program that passed and must not have.
    """
    program, findings = check_text(text, filename, types)
    lines = text.removeprefix("\ufeff").split("\n")
    for finding in findings:
        assert finding.length >= 0 and finding.code and finding.message
        if finding.file == filename:
            assert 1 <= finding.line <= len(lines)
            assert 1 <= finding.column <= len(lines[finding.line - 1]) + 1
    assert render(findings)
    assert (program is None) == any(f.severity == "error" for f in findings)
    if program is None:
        return False
    grammar().parse(text, start="program")  # no text passes that the whole grammar refuses
    for node in program.nodes.values():
        assert_sound(program, node.name, types[node.type])
    walk(program, random.Random(seed))
    return True


def assert_sound(program: Program, name: str, kind: NodeType) -> None:
    """Values within their ranges, every event handled, every target there, a way to an end."""
    node = program.nodes[name]
    assert {p.name for p in kind.parameters} == set(node.parameters)
    for parameter in kind.parameters:
        value = node.parameters[parameter.name]
        if value != parameter.default and not isinstance(value, str):
            assert parameter.lo <= value <= parameter.hi
    for event in () if kind.terminal else kind.events:
        armed = event.needs is None or node.parameters[event.needs] != math.inf
        assert not armed or event.name in node.transitions
    for guard in node.guards:
        assert kind.quantity(guard.quantity) and math.isfinite(guard.limit)
    reached, waiting = {name}, [name]
    while waiting:
        at = program.node(waiting.pop())
        ways = {*at.transitions.values(), *(guard.target for guard in at.guards)}
        waiting += ways - reached
        reached |= ways
    assert any(program.node(each).terminal for each in reached)


def walk(program: Program, rng: random.Random, steps: int = 60) -> None:
    """Random events, guards and aborts from the start; every one must lead somewhere."""
    automaton = Automaton(program)
    automaton.start()
    for _ in range(steps):
        if automaton.finished:
            automaton.start()
        limits = [0.0, math.inf, -math.inf, math.nan, *(g.limit for g in automaton.guards)]
        values = {g.quantity: rng.choice(limits) + rng.choice((-1, 0, 1)) for g in automaton.guards}
        was, kind = automaton.transitions, rng.random()
        if kind < 0.1:
            automaton.fire("Abort")
        elif kind < 0.5 or not automaton.events:
            holding = any(g.holds(values[g.quantity]) for g in automaton.guards)
            assert (automaton.check_guards(values) is not None) == holding
            was += not holding
        else:
            automaton.fire(rng.choice(automaton.events))
        assert automaton.transitions <= was + 1
        assert automaton.node.name in (*program.nodes, "End")


def judge_all(count: int, seed: int) -> Counter[str]:
    """Judge that many mutants; what became of them."""
    verdicts: Counter[str] = Counter()
    for number, (text, path, types) in enumerate(mutants(count, seed)):
        if text == path.read_text(encoding="utf-8"):
            verdicts["unchanged"] += 1
            continue
        try:
            passed = judge(text, str(path), types, seed + number)
        except Exception:
            print(f"--- mutant {number} of {path.name}\n{text}", file=sys.stderr)
            raise
        verdicts["valid" if passed else "refused"] += 1
    return verdicts
