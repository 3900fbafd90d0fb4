"""Programs broken at random: the checker never crashes, and what it passes runs."""

import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.hds import Automaton, Registry, check_text, render
from arm.hds.parser import grammar

_TOKEN = re.compile(r'%[^\n]*|"[^"\n]*"|\w+|\s+|.')
_OPERATION = st.sampled_from(["delete", "duplicate", "swap", "replace"])


def mutate(pieces: list[str], operation: str, where: int, other: int) -> list[str]:
    """One piece deleted, doubled, swapped with or replaced by another."""
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


def check_and_run(text: str, types: Registry, seed: int) -> bool:
    """Check a text whatever it is; run it if it passes; whether it passed."""
    program, findings = check_text(text, "mutant.hds", types)
    lines = text.split("\n")
    for finding in findings:
        assert 1 <= finding.line <= len(lines)
        assert 1 <= finding.column <= len(lines[finding.line - 1]) + 1
        assert finding.length >= 0
    assert render(findings)
    assert (program is None) == any(f.severity == "error" for f in findings)
    if program is None:
        return False
    grammar().parse(text, start="program")  # no text passes that the whole grammar refuses
    assert {n.type for n in program.nodes.values()} <= set(types)
    automaton, choice = Automaton(program), random.Random(seed)
    automaton.start()
    for _ in range(50):
        if automaton.finished:
            break
        node_type = types[automaton.node.type]
        given_names = automaton.node.parameters
        # every event the node can raise leads somewhere
        for event in node_type.events:
            armed = event.needs is None or given_names[event.needs] != float("inf")
            assert not armed or event.name in automaton.events
        automaton.fire(choice.choice(automaton.events))
    return True


@pytest.mark.parametrize("unit", ["token", "line"])
@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_mutants_never_crash_and_what_passes_runs(
    unit: str, good: str, types: Registry, data: st.DataObject
) -> None:
    """Up to three deletions, doublings, swaps or replacements of tokens or lines."""
    pieces = _TOKEN.findall(good) if unit == "token" else good.splitlines(keepends=True)
    for _ in range(data.draw(st.integers(1, 3))):
        operation = data.draw(_OPERATION)
        where, other = data.draw(st.integers(0, 500)), data.draw(st.integers(0, 500))
        pieces = mutate(pieces, operation, where, other)
    check_and_run("".join(pieces), types, seed=len(pieces))


@settings(max_examples=150, deadline=None)
@given(text=st.text(max_size=200), where=st.integers(0, 1000))
def test_any_text_is_judged(text: str, where: int, good: str, types: Registry) -> None:
    """Arbitrary text, alone or dropped into a program, gives findings or a program, no crash."""
    check_and_run(text, types, seed=0)
    check_and_run(good[:where] + text + good[where:], types, seed=0)


def test_every_single_deletion_and_doubling(good: str, types: Registry) -> None:
    """All programs one token away are judged; nearly all are refused, the rest run."""
    pieces = _TOKEN.findall(good)
    passed = 0
    for i, piece in enumerate(pieces):
        if not piece.strip() or piece.startswith("%"):
            continue
        check_and_run("".join(mutate(pieces, "duplicate", i, i)), types, seed=i)
        passed += check_and_run("".join(mutate(pieces, "delete", i, i)), types, seed=i)
    assert passed <= 4  # dropping the decimals or the sign of a number may leave a good program
