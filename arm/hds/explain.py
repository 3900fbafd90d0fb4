"""A program as the paper's tuples, H = (Q, X, I, f, E, G, T) and A = (Q, E, delta, T, mu)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from arm.hds import analysis
from arm.hds.discrete import Discrete, Edge, discrete
from arm.hds.nodetype import NodeType, ParameterValue, Registry
from arm.hds.program import END, Node, Program


def show_value(kind: NodeType | None, name: str, value: ParameterValue) -> str:
    """A parameter's SI value in the parameter's own unit: ``50 mm``."""
    parameter = kind.parameter(name) if kind else None
    if isinstance(value, str) or parameter is None:
        return str(value)
    unit = parameter.default_unit
    return f"{unit.from_si(value):.6g}" + ("" if unit.name == "1" else f" {unit.name}")


def settings(node: Node, types: Registry, changed: bool = False) -> list[str]:
    """``Name = value`` of a node's parameters; what says "no limit" is left out.

    Args:
        node: the node.
        types: the node types, for units and defaults.
        changed: only those that differ from the type's default.
    """
    kind = types.get(node.type)
    shown = []
    for name, value in node.parameters.items():
        parameter = kind.parameter(name) if kind else None
        unlimited = isinstance(value, float) and math.isinf(value)
        default = changed and parameter is not None and value == parameter.default
        if not unlimited and not default and value != "":
            shown.append(f"{name} = {show_value(kind, name, value)}")
    return shown


def explanation(program: Program, types: Registry) -> dict[str, Any]:
    """Both tuples and the analyses as plain data, in the order the text shows them."""
    automaton = discrete(program, types)
    used = {node.type: types.get(node.type) for node in program.nodes.values()}
    shortest = analysis.shortest_way(automaton)
    return {
        "program": program.path,
        "sha256": program.sha256,
        "H": {
            "Q": {
                node.name: {"type": node.type, "parameters": settings(node, types)}
                for node in program.nodes.values()
            },
            "X": {
                name: [
                    {"name": q.name, "unit": q.default_unit.name, "doc": q.doc} for q in kind.offers
                ]
                for name, kind in used.items()
                if kind is not None
            },
            "I": program.initial,
            "f": {name: kind.doc for name, kind in used.items() if kind is not None},
            "E": {node.name: list(node.transitions) for node in program.nodes.values()},
            "G": {node.name: [g.text for g in node.guards] for node in program.nodes.values()},
            "T": [_entry(edge) for edge in automaton.edges if edge.kind != "abort"],
            "abort": program.abort,
        },
        "A": {
            "Q": list(automaton.nodes),
            "E": list(automaton.events),
            "delta": automaton.initial,
            "T": {
                name: {e.label: e.target for e in automaton.out(name) if e.kind != "abort"}
                for name in automaton.nodes
            },
            "mu": [name for name in automaton.nodes if name in automaton.terminals],
        },
        "analysis": {
            "unreachable": _absent(automaton, analysis.reachable(automaton)),
            "blocking": _ordered(automaton, analysis.blocking(automaton)),
            "cycles": analysis.cycles(automaton),
            "shortest": None if shortest is None else [_entry(edge) for edge in shortest],
            "longest": analysis.longest_way(automaton),
            "conflicts": [vars(c) for c in analysis.conflicts(program)],
        },
    }


def _entry(edge: Edge) -> dict[str, Any]:
    entry: dict[str, Any] = {"from": edge.source, "on": edge.label, "to": edge.target}
    return entry if edge.possible else entry | {"possible": False}


def _ordered(automaton: Discrete, names: set[str]) -> list[str]:
    return [name for name in automaton.nodes if name in names]


def _absent(automaton: Discrete, names: set[str]) -> list[str]:
    return [name for name in automaton.nodes if name not in names]


def explain(program: Program, types: Registry) -> str:
    """The same for people."""
    data = explanation(program, types)
    h, found = data["H"], data["analysis"]
    lines = [f"{program.path}: H = (Q, X, I, f, E, G, T)", "", "Q  nodes, with type and parameters"]
    lines += _table(
        [(name, n["type"], ", ".join(n["parameters"])) for name, n in h["Q"].items()]
        + ([(END.name, "predefined", "")] if END.name in data["A"]["Q"] else [])
    )
    lines += ["", "X  continuous variables guards may look at, by node type"]
    lines += _table(
        [(name, q["name"], f"[{q['unit']}]", q["doc"]) for name, qs in h["X"].items() for q in qs]
    )
    lines += ["", f"I  initial: {h['I']}, with the variables as they are found"]
    lines += ["", "f  control law of each node type"]
    lines += _table(list(h["f"].items()))
    lines += ["", "E  events each node handles; Abort besides, in every node"]
    lines += _table([(name, ", ".join(events) or "-") for name, events in h["E"].items()])
    lines += ["", "G  guards, in the order they are looked at"]
    guarded = [(name, ", ".join(texts)) for name, texts in h["G"].items() if texts]
    lines += _table(guarded) if guarded else ["   none"]
    lines += ["", "T  transitions"]
    lines += _table(
        [
            (t["from"], t["on"], "->", t["to"], "" if t.get("possible", True) else "never happens")
            for t in h["T"]
        ]
        + [("(every node)", "Abort", "->", h["abort"], "")]
    )
    lines += ["", "discrete part: A = (Q, E, delta, T, mu)"]
    lines += _table(
        [
            ("Q", _count(len(data["A"]["Q"]), "node"), ", ".join(data["A"]["Q"])),
            ("E", _count(len(data["A"]["E"]), "event or guard", "events and guards"),
             ", ".join(data["A"]["E"])),
            ("delta", "initial", data["A"]["delta"]),
            ("T", "as above", f"{len(h['T'])} transitions, and Abort from every node"),
            ("mu", "terminal", ", ".join(data["A"]["mu"]) or "none"),
        ]
    )  # fmt: skip
    lines += ["", "analysis", *_analysis(found)]
    return "\n".join(line.rstrip() for line in lines)


def _analysis(found: dict[str, Any]) -> list[str]:
    rows = [
        ("reachable", "every node" if not found["unreachable"] else
         "not: " + ", ".join(found["unreachable"])),
        ("non-blocking", "yes: from every node the program can be in, a way leads to an end"
         if not found["blocking"] else "no: no way to an end from " + ", ".join(found["blocking"])),
    ]  # fmt: skip
    shortest = found["shortest"]
    if shortest is not None:
        way = "".join(f"{t['from']} -{t['on']}-> " for t in shortest)
        end = shortest[-1]["to"] if shortest else ""
        rows.append(("shortest way", f"{_count(len(shortest), 'transition')}: {way}{end}"))
        longest = found["longest"]
        text = "without bound: it goes through a cycle"
        rows.append(("longest way", text if longest is None else _count(longest, "transition")))
    cycles = "; ".join(", ".join(part) for part in found["cycles"])
    rows.append(("on cycles", cycles or "no node"))
    if not found["conflicts"]:
        rows.append(("deterministic", "yes: no two transitions of a node can be due at once"))
        return _table(rows)
    rows.append(("deterministic", "yes, by rule, where two transitions can be due at once:"))
    lines = _table(rows)
    grouped: dict[tuple[str, str, str], list[str]] = {}
    for c in found["conflicts"]:
        rule = c["rule"] + ("; the second can never be taken" if c["never"] else "")
        grouped.setdefault((c["node"], c["second"], rule), []).append(c["first"])
    for (node, second, rule), firsts in grouped.items():
        lines.append(f"      {node}: {', '.join(firsts)} before {second} ({rule})")
    return lines


def _count(number: int, noun: str, plural: str = "") -> str:
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def _table(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Rows with their columns one under another."""
    if not rows:
        return ["   none"]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "   " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
