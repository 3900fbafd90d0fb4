"""The analyses of A = (Q, E, delta, T, mu) against brute force, and the tuples in print."""

from __future__ import annotations

import json

import pytest

from arm.hds import Guard, Registry, check_text
from arm.hds import analysis as hds
from arm.hds.discrete import discrete
from arm.hds.explain import explain, explanation
from arm.hds.guards import implies
from tests.arm.hds.automata import EVENTS, TYPES, program, random_table


def brute_ways(table: dict[str, dict[str, str]], steps: int) -> dict[str, set[str]]:
    """Where every node can be within ``steps`` events, by trying them all."""
    there = {name: {name} for name in [*table, "End"]}
    for _ in range(steps):
        there = {
            name: nodes | {t for n in nodes for t in table.get(n, {}).values()}
            for name, nodes in there.items()
        }
    return there


@pytest.mark.parametrize("seed", range(200))
def test_reachable_coreachable_and_cycles_are_what_trying_finds(seed: int) -> None:
    """Random automata of five nodes; abort leads to End, so End is always reachable."""
    table = random_table(seed)
    automaton = discrete(program(table), TYPES)
    ways = brute_ways(table, 6)
    assert hds.reachable(automaton) == ways["N0"] | {"End"}
    ends = {name for name, row in table.items() if not row} | {"End"}
    good = {name for name in automaton.nodes if ways[name] & ends}
    assert hds.coreachable(automaton) == good
    assert hds.blocking(automaton) == (ways["N0"] | {"End"}) - good
    on_cycles = {n for n in table if any(n in ways[t] for t in table[n].values())}
    assert {name for part in hds.cycles(automaton) for name in part} == on_cycles


@pytest.mark.parametrize("seed", range(200))
def test_shortest_and_longest_way_are_what_trying_finds(seed: int) -> None:
    """Every sequence of up to nine events is tried."""
    table = random_table(seed, size=4)
    automaton = discrete(program(table), TYPES)
    lengths = set()
    at = {"N0"}
    for length in range(1, 10):
        at = {t for n in at for t in table.get(n, {}).values()}
        if any(not table.get(n) for n in at):
            lengths.add(length)
    shortest = hds.shortest_way(automaton)
    assert (len(shortest) if shortest else None) == min(lengths, default=None)
    if shortest:
        node = "N0"
        for edge in shortest:
            assert edge.source == node
            node = table[node][edge.label]
        assert node in automaton.terminals
    longest = hds.longest_way(automaton)
    if longest is None:
        assert max(lengths) > 4
    else:
        assert longest == max(lengths, default=0)


def guard(text: str, target: str = "End") -> Guard:
    """``Force > 5`` as a guard."""
    quantity, operator, limit = text.split()
    return Guard(quantity, operator, float(limit), target, text)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("first", "second", "both", "never"),
    [
        ("Force > 5", "Force < 3", False, False),
        ("Force > 5", "Force < 5", False, False),
        ("Force >= 5", "Force <= 5", True, False),
        ("Force >= 5", "Force < 5", False, False),
        ("Force > 3", "Force < 5", True, False),
        ("Force > 3", "Force > 5", True, True),
        ("Force > 5", "Force > 3", True, False),
        ("Force > 5", "Force >= 5", True, False),
        ("Force >= 5", "Force > 5", True, True),
        ("Force < 5", "Force <= 4", True, True),
        ("Force > 5", "Time > 5", True, False),
    ],
)
def test_guards_that_can_hold_at_once(first: str, second: str, both: bool, never: bool) -> None:
    """Tried on a grid of values too: what is said to meet meets, what is not does not."""
    a, b = guard(first), guard(second)
    assert hds.overlap(a, b) == hds.overlap(b, a) == both
    assert implies(b, a) == never
    if a.quantity == b.quantity:
        grid = [k / 4 for k in range(41)]
        assert any(a.holds(v) and b.holds(v) for v in grid) == both
        assert all(a.holds(v) for v in grid if b.holds(v)) == never


def test_a_conflict_names_the_rule_that_decides() -> None:
    """An event comes before a guard, a guard before those below it."""
    made = program(
        {"A": {"a": "End"}}, guards=[("A", guard("Force > 3")), ("A", guard("Force > 5"))]
    )
    found = hds.conflicts(made)
    assert [(c.first, c.second, c.rule, c.never) for c in found] == [
        ("a", "Force > 3", hds.EVENT_FIRST, False),
        ("a", "Force > 5", hds.EVENT_FIRST, False),
        ("Force > 3", "Force > 5", hds.TEXT_ORDER, True),
    ]


def test_an_event_that_cannot_happen_is_no_way(types: Registry, good: str) -> None:
    """Timeout without the parameter Timeout leads nowhere, whatever is written."""
    text = good.replace("TRANSITION[Contact]", "TRANSITION[Timeout] = Rest1; TRANSITION[Contact]")
    made, _ = check_text(text, "x.hds", types)
    assert made is not None
    edge = next(e for e in discrete(made, types).edges if e.label == "Timeout")
    assert not edge.possible
    assert "never happens" in explain(made, types)


def test_the_tuples_in_print(types: Registry, good: str) -> None:
    """Each of the seven and of the five stands there with what the paper's fragment says."""
    made, _ = check_text(good, "good.hds", types)
    assert made is not None
    shown = explain(made, types)
    for head in ("Q  nodes", "X  continuous", "I  initial: Approach1", "f  control law"):
        assert head in shown
    for line in (
        "Approach1  Whiteboard_approach  Force = 200 cN, Filter = 4, MaxX = 700 mm, Speed = 20",
        "Approach1      Contact       ->  Line1",
        "(every node)   Abort         ->  End",
        "on cycles      Approach1, Line1, Retract1, Choose1",
        "longest way    without bound: it goes through a cycle",
        "mu     terminal             Rest1, End",
    ):
        assert " ".join(line.split()) in " ".join(shown.split())
    data = json.loads(json.dumps(explanation(made, types)))
    assert list(data["H"]) == ["Q", "X", "I", "f", "E", "G", "T", "abort"]
    assert list(data["A"]) == ["Q", "E", "delta", "T", "mu"]
    assert data["A"]["T"]["Approach1"] == {"Contact": "Line1", "Out_of_Reach": "End"}


def test_a_deep_chain_needs_no_recursion() -> None:
    """Ten thousand nodes in a row."""
    table = {f"N{i}": {EVENTS[0]: f"N{i + 1}"} for i in range(10_000)} | {"N10000": {}}
    automaton = discrete(program(table), TYPES)
    assert hds.longest_way(automaton) == 10_000
    assert hds.cycles(automaton) == []
