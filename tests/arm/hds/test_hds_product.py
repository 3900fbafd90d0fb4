"""Specifications: what they say, what is wrong with them, and the product against brute force."""

from __future__ import annotations

import itertools
import random

import pytest

from arm.hds import Program, Registry, check_text
from arm.hds.product import Verdict, render_verdict, verify_program
from arm.hds.specification import ENTERED, FORBIDDEN, Happening, Rule, Specification, Symbol
from arm.hds.specification_check import check_specification
from tests.arm.hds.automata import EVENTS, TYPES, program, random_table

CONTACT_FIRST = """\
% never a line before an approach raised Contact
INITIAL = Away;
BEGIN
    NAME = Away;
    TRANSITION[Whiteboard_approach.Contact] = Touching;
    TRANSITION[Whiteboard_line] = Forbidden;
END
BEGIN
    NAME = Touching;
    TRANSITION[Goto_pose] = Away;
END
"""


def ready(good: str, types: Registry) -> Program:
    """The good program, checked."""
    made, _ = check_text(good, "good.hds", types)
    assert made is not None
    return made


def judged(good: str, types: Registry, spec: str, abort: bool = True) -> Verdict:
    """The verdict on the good program, or an altered one."""
    made = ready(good, types)
    wanted, findings = check_specification(spec, "s.spec", made, types)
    assert wanted is not None, findings
    return verify_program(made, types, wanted, abort)


def random_specification(seed: int) -> Specification:
    """Two or three states, rules on events, on nodes and on events of nodes."""
    rng = random.Random(seed)
    names = [f"S{i}" for i in range(rng.randrange(2, 4))]
    states = {}
    for name in names:
        rules = []
        for line in range(rng.randrange(1, 4)):
            place = rng.choice(["", "N1", "N2", "Work", "N3"])
            what = rng.choice([*EVENTS, ENTERED]) if place else rng.choice(EVENTS)
            target = rng.choice([*names, FORBIDDEN])
            rules.append(Rule((Symbol(place, what),), target, line + 1))
        states[name] = tuple(rules)
    return Specification(states, "S0", "random.spec")


def accepted(spec: Specification, made: Program, events: tuple[str, ...]) -> bool | None:
    """Whether a sequence of events stays in the specification; None if it is no trace."""
    node, state = made.initial, spec.initial
    state, _ = spec.step(state, Happening(ENTERED, node, made.node(node).type))
    for event in events:
        if state == FORBIDDEN:
            return False
        here = made.node(node)
        target = here.transitions.get(event)
        if here.terminal or target is None:
            return None
        state, _ = spec.step(state, Happening(event, node, here.type))
        if state == FORBIDDEN:
            return False
        node = target
        state, _ = spec.step(state, Happening(ENTERED, node, made.node(node).type))
    return state != FORBIDDEN


@pytest.mark.parametrize("seed", range(150))
def test_the_product_finds_what_trying_every_trace_finds(seed: int) -> None:
    """All sequences of up to six events; the trace it names is a shortest that leaves."""
    made, spec = program(random_table(seed, size=4)), random_specification(seed)
    verdict = verify_program(made, TYPES, spec, abort=False)
    shortest = None
    for length in range(7):
        if any(accepted(spec, made, t) is False for t in itertools.product(EVENTS, repeat=length)):
            shortest = length
            break
    if verdict.violation is None:
        assert shortest is None
        return
    trace = tuple(edge.label for edge in verdict.violation.trace)
    if shortest is None:
        assert len(trace) > 6
    else:
        assert len(trace) == shortest
    assert accepted(spec, made, trace) is False
    assert not trace or accepted(spec, made, trace[:-1]) is True


def test_contact_before_every_line(good: str, types: Registry) -> None:
    """The paper's fragment keeps it; started at the line it does not, and the trace says so."""
    assert judged(good, types, CONTACT_FIRST).holds
    altered = good.replace("INITIAL   = Approach1", "INITIAL   = Retract1").replace(
        "TRANSITION[Again] = Approach1", "TRANSITION[Again] = Line1"
    )
    verdict = judged(altered, types, CONTACT_FIRST)
    assert verdict.violation is not None
    assert [edge.label for edge in verdict.violation.trace] == ["Finished", "Again"]
    assert verdict.violation.rule.line == 6
    text = render_verdict(ready(altered, types), judged_spec(altered, types), verdict)
    assert text.startswith("s.spec:6: good.hds leaves the specification")
    assert "2. Choose1 -[Again]-> Line1" in text


def judged_spec(good: str, types: Registry) -> Specification:
    """``CONTACT_FIRST`` for a program."""
    made, _ = check_specification(CONTACT_FIRST, "s.spec", ready(good, types), types)
    assert made is not None
    return made


def test_starting_in_a_forbidden_node_is_a_trace_of_no_edge(good: str, types: Registry) -> None:
    """The first node is entered too."""
    verdict = judged(good.replace("INITIAL   = Approach1", "INITIAL = Line1"), types, CONTACT_FIRST)
    assert verdict.violation is not None
    assert verdict.violation.trace == ()


def test_abort_counts_unless_told_otherwise(good: str, types: Registry) -> None:
    """Nothing but Abort ends this program from a line."""
    spec = (
        "INITIAL = Free; BEGIN NAME = Free; TRANSITION[Whiteboard_line] = Busy; END "
        "BEGIN NAME = Busy; TRANSITION[Line1.Finished] = Free; TRANSITION[End] = Forbidden; END"
    )
    verdict = judged(good, types, spec)
    assert verdict.violation is not None
    assert verdict.violation.trace[-1].label == "Abort"
    assert judged(good, types, spec, abort=False).holds


def test_a_state_the_program_never_brings_about_is_told(good: str, types: Registry) -> None:
    """A specification that only seems to hold says which part said nothing."""
    spec = (
        "INITIAL = A; BEGIN NAME = A; TRANSITION[Timeout] = B; END "
        "BEGIN NAME = B; TRANSITION[Whiteboard_line] = Forbidden; END"
    )
    verdict = judged(good, types, spec)
    assert verdict.holds
    assert verdict.unreached == ("B",)


@pytest.mark.parametrize(
    ("old", "new", "code", "help"),
    [
        ("Whiteboard_approach.Contact", "Approach9.Contact", "unknown-node", "'Approach1'?"),
        ("Whiteboard_approach.Contact", "Line1.Contact", "unknown-event", "Finished"),
        ("Whiteboard_line]", "Whiteboard_lin]", "unknown-event", "'Whiteboard_line'?"),
        ("= Touching;\n    T", "= Touch;\n    T", "unknown-target", "'Touching'?"),
        ("INITIAL = Away", "INITIAL = Avay", "unknown-initial", "'Away'?"),
        ("INITIAL = Away;", "", "missing-initial", "INITIAL = Away"),
        ("NAME = Touching", "NAME = Away", "duplicate-node", ""),
        ("NAME = Touching", "NAME = Forbidden", "reserved-name", ""),
        ("    NAME = Touching;\n", "", "missing-name", "NAME"),
        ("Forbidden;\nEND", "Forbidden;\n", "missing-end", ""),
        ("NAME = Away;", "NAME Away;", "syntax", "statements"),
        ("[Goto_pose]", "[Goto_pose", "syntax", "statements"),
        ("= Away;\nEND\n", "= Away;", "missing-end", ""),
    ],
)
def test_a_wrong_specification_is_refused_at_its_place(
    good: str, types: Registry, old: str, new: str, code: str, help: str
) -> None:
    """Findings like a program's: code, line, what to write."""
    assert old in CONTACT_FIRST
    text = CONTACT_FIRST.replace(old, new, 1)
    made, findings = check_specification(text, "s.spec", ready(good, types), types)
    assert made is None
    found = [f for f in findings if f.code == code]
    assert found, findings
    assert help in found[0].help
    assert found[0].render().startswith(f"s.spec:{found[0].line}:{found[0].column}: error[{code}]")


def test_a_name_that_is_a_node_and_an_event_must_be_spelt_out(types: Registry, good: str) -> None:
    """``Contact.Entered`` is the node."""
    text = good.replace("Retract1", "Contact")
    made = ready(text, types)
    spec = "INITIAL = A; BEGIN NAME = A; TRANSITION[Contact] = Forbidden; END"
    refused, findings = check_specification(spec, "s.spec", made, types)
    assert refused is None
    assert findings[0].code == "ambiguous-name"
    spelt, _ = check_specification(spec.replace("Contact]", "Contact.Entered]"), "s", made, types)
    assert spelt is not None
