"""One test per kind of finding: its code, its place, its help, and that nothing else is said.

``«`` in the changed text marks where the finding must point; it is not part of the program.
"""

from dataclasses import asdict, dataclass

import pytest

from arm.hds import Finding, Registry, check_text, render
from arm.hds.parser import KEYWORDS


@dataclass(frozen=True)
class Case:
    """A change of the good program and the one finding it must cause."""

    code: str
    old: str
    new: str
    help: str = ""
    message: str = ""
    covers: str | None = None
    severity: str = "error"


ALONE = "BEGIN NAME = «A; TYPE = Rest; END\n"
LOOP = """
BEGIN NAME = «A; TYPE = Choose; TRANSITION[Again] = B; TRANSITION[Done] = End; END
BEGIN NAME = B; TYPE = Choose; TRANSITION[Again] = A; TRANSITION[Done] = A; END
BEGIN"""

CASES = [
    # lexical
    Case("unexpected-character", "Filter = 4;", "Filter «$= 4;", message="dollar sign"),
    Case("unexpected-character", "Filter = 4;", "Filter = 4; «# four", "starts with '%'"),
    Case("unterminated-string", "Mode = Soft;", 'Mode = «"Soft;', "close it"),
    # syntactic
    Case("syntax", "Filter = 4;", "Filter «4;", message="expected '=', found '4'"),
    Case("syntax", "Filter = 4;", "Filter = «;", message="expected a name or a number or a"),
    Case("syntax", "Filter = 4;", "Filter =« ", message="after '='"),
    Case("syntax", "[Contact] =", "[Contact «=", message="expected ']' or a comparison, found '='"),
    Case("syntax", "= End;", "= «END;", "is written 'End'", "found the keyword END"),
    Case("syntax", "TYPE = Whiteboard_line;", 'TYPE = «"Whiteboard_line";', "without quotes"),
    Case("syntax", "Filter = 4;", "Filter = 4;«;", "a parameter's name", "no statement starts"),
    Case("missing-semicolon", "Filter = 4;", "Filter = 4«", "ends with ';'"),
    Case("missing-semicolon", "= Choose1;\nEND", "= Choose1«\nEND", "ends with ';'"),
    Case("missing-semicolon", "Force = 200;", "Force = 2 N«", message="after 'N'"),
    Case("misspelt-keyword", "INITIAL ", "«Initial", "mean 'INITIAL'", covers="Initial"),
    Case("misspelt-keyword", "TRANSITION[Contact]", "«TRANSITON[Contact]", "mean 'TRANSITION'"),
    Case("misspelt-keyword", "BEGIN\n    NAME = Line1;", "«Begin\nNAME = Line1;", "'BEGIN'"),
    Case("misspelt-keyword", "Retract1;\nEND", "Retract1;\n«ENDD", "'END'", covers="ENDD"),
    Case("misplaced-statement", "Filter = 4;", "«INTERFACE = r1;", "before the first BEGIN"),
    Case("missing-begin", "BEGIN\n    NAME = Line1;", "«NAME = Line1;", "starts with BEGIN"),
    Case(
        "missing-end",
        "BEGIN\n    NAME = Rest1;\n    TYPE = Rest;\nEND",
        "«BEGIN NAME = Rest1; TYPE = Rest;",
    ),
    Case("stray-end", "Retract1;\nEND", "Retract1;\nEND\n«END", message="without a BEGIN"),
    # whole program
    Case("missing-interface", "INTERFACE = r1;", "«", "add INTERFACE"),
    Case(
        "missing-initial",
        "INTERFACE = r1;\nINITIAL   = Approach1;",
        "«INTERFACE = r1;",
        "add INITIAL = Approach1;",
    ),
    Case("duplicate-statement", "INTERFACE = r1;", "INTERFACE = r1; INTERFACE = «r2;", covers="r2"),
    Case("unknown-initial", "INITIAL   = Approach1", "INITIAL = «Aproach1", "mean 'Approach1'"),
    # names
    Case("missing-type", "NAME = Rest1;\n    TYPE = Rest;", "NAME = «Rest1;", "Whiteboard_line"),
    Case("duplicate-statement", "TYPE = Rest;", "TYPE = Rest; TYPE = «Rest;"),
    Case("duplicate-statement", "NAME = Rest1;", "NAME = Rest1; NAME = «Rest2;"),
    Case(
        "duplicate-node",
        "BEGIN\n    NAME = Rest1;",
        "BEGIN NAME = «Line1; TYPE = Rest; END\nBEGIN NAME = Rest1;",
        message="on line 18",
    ),
    Case(
        "reserved-name",
        "BEGIN\n    NAME = Rest1;",
        "BEGIN NAME = «End; TYPE = Rest; END\nBEGIN NAME = Rest1;",
    ),
    Case(
        "unknown-type",
        "TYPE = Whiteboard_line;",
        "TYPE = «whiteboard_Line;",
        "mean 'Whiteboard_line'?",
    ),
    # parameters
    Case(
        "unknown-parameter",
        "Filter = 4;",
        "«filter = 4;",
        "mean 'Filter'? (valid names: Force",
        covers="filter",
    ),
    Case("unknown-parameter", "Force = 200;", "«Froce = 200;", "mean 'Force'?"),
    Case("unknown-parameter", "Filter = 4;", "«Name = Foo;", "mean 'NAME'?"),
    Case("missing-parameter", "Speed = 40;", "", "add Speed = ... mm/s; % speed of the tool"),
    Case("duplicate-parameter", "Speed = 40;", "Speed = 40; «Speed = 40;", message="on line 23"),
    # values
    Case(
        "unknown-unit",
        "Force = 200;",
        "Force = 200 «Newton;",
        "units of force: N, cN",
        covers="Newton",
    ),
    Case("unknown-unit", "Speed = 20;", "Speed = 20 «mm/sec;", "mean 'mm/s'?", covers="mm/sec"),
    Case(
        "wrong-dimension",
        "Force = 200;",
        "Force = 200 «mm;",
        "units of force: N, cN",
        "is a force, but 'mm' is a unit of length",
    ),
    Case("wrong-dimension", "Filter = 4;", "Filter = 4 «Hz;", "units of pure number: 1"),
    Case("unknown-constant", "Force = 200;", "Force = «Strong;", "declare CONSTANT Strong"),
    Case("wrong-kind", "Force = 200;", 'Force = «"Strong";', message="a number, not the word"),
    Case("wrong-kind", "Filter = 4;", 'Filter = «"4";', message="an integer, not the word"),
    Case("wrong-kind", "Mode = Soft;", "Mode = «3;", "valid words: Soft, Stiff"),
    Case("unknown-choice", "Mode = Soft;", "Mode = «soft;", "mean 'Soft'?"),
    Case("not-an-integer", "Filter = 4;", "Filter = «4.5;", message="not 4.5"),
    Case(
        "out-of-range",
        "Force = 200;",
        "Force = «9000;",
        "from 20 cN to 2000 cN; a bare number is in cN",
        covers="9000",
    ),
    Case("out-of-range", "Force = 200;", "Force = «200 N;", "from 0.2 N to 20 N", covers="200 N"),
    Case("out-of-range", "Speed = 40;", "Speed = «1e999;", "from 1 mm/s to 250 mm/s"),
    # events and transitions
    Case(
        "unknown-event",
        "TRANSITION[Contact]",
        "TRANSITION[«contact]",
        "mean 'Contact'? (valid events: Contact",
        covers="contact",
    ),
    Case("unhandled-event", "TRANSITION[Contact] = Line1;", "", "add TRANSITION[Contact]"),
    Case(
        "duplicate-transition",
        "[Contact] = Line1;",
        "[Contact] = Line1; TRANSITION[«Contact] = End;",
        message="line 13",
    ),
    Case(
        "unknown-target", "[Contact] = Line1", "[Contact] = «Line2", "mean 'Line1'?", covers="Line2"
    ),
    Case("terminal-transition", "TYPE = Rest;", "TYPE = Final; TRANSITION[«Finished] = End;"),
    Case(
        "impossible-event",
        "[Contact] = Line1;",
        "[Contact] = Line1; TRANSITION[«Timeout] = End;",
        "set Timeout",
        severity="warning",
    ),
    # flow
    Case(
        "unreachable-node",
        "\nBEGIN\n    NAME = Rest1;",
        "\n" + ALONE + "BEGIN\nNAME = Rest1;",
        message="from 'Approach1' to the node 'A'",
        severity="warning",
    ),
]


def _points_at(text: str, finding: Finding) -> str:
    line = text.split("\n")[finding.line - 1]
    return line[finding.column - 1 : finding.column - 1 + finding.length]


@pytest.fixture(scope="module")
def more_types(types: Registry) -> Registry:
    """The shared types, and a terminal one that raises an event."""
    from arm.hds import Event, NodeType

    return {**types, "Final": NodeType("Final", (), (Event("Finished"),), terminal=True)}


@pytest.mark.parametrize("case", CASES, ids=[f"{c.code}-{i}" for i, c in enumerate(CASES)])
def test_finding(case: Case, good: str, more_types: Registry) -> None:
    """Each fault causes exactly its own finding, at its place, with its help."""
    assert good.count(case.old) >= 1
    marked = good.replace(case.old, case.new, 1)
    text = marked.replace("«", "")
    program, findings = check_text(text, "bad.hds", more_types)
    found = [f for f in findings if f.code != "unreachable-node" or f.code == case.code]
    assert [f.code for f in found] == [case.code], render(findings)
    finding = found[0]
    assert finding.severity == case.severity
    assert (program is None) == (case.severity == "error")
    assert case.help in finding.help
    assert case.message in finding.message
    if "«" in marked:
        before = marked[: marked.index("«")]
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        assert (finding.line, finding.column) == (line, column), finding.render()
    if case.covers is not None:
        assert _points_at(text, finding) == case.covers


def test_absent_things_point_at_the_node(good: str, types: Registry) -> None:
    """What a node lacks is reported at the node's name."""
    for gone in ("    Speed = 40;\n", "    TRANSITION[Finished] = Retract1;\n"):
        text = good.replace(gone, "", 1)
        _, findings = check_text(text, "a", types)
        error = next(f for f in findings if f.severity == "error")
        assert (error.line, error.column) == (18, 12)
        assert _points_at(text, error) == "Line1"


def test_missing_name(good: str, types: Registry) -> None:
    """A node without NAME is reported at its BEGIN, and so is who misses it."""
    text = good.replace("    NAME = Rest1;\n", "")
    _, findings = check_text(text, "a", types)
    assert {(f.code, f.line, f.column) for f in findings} == {
        ("unknown-target", 42, 24),
        ("missing-name", 45, 1),
    }


def test_zero_time_cycle(good: str, types: Registry) -> None:
    """A cycle of nodes that need no time is one error, which shows the way round."""
    marked = good.replace("= Choose1;", "= A;", 1).replace("\nBEGIN", LOOP, 1)
    text = marked.replace("«", "")
    _, findings = check_text(text, "a", types)
    errors = [f for f in findings if f.severity == "error"]
    assert [f.code for f in errors] == ["zero-time-cycle"], render(findings)
    assert "A -> B -> A" in errors[0].message
    assert _points_at(text, errors[0]) == "A"


def test_no_way_to_end(good: str, types: Registry) -> None:
    """Every node from which the program can never end is an error at its name."""
    text = good.replace("[Done] = Rest1", "[Done] = Line1").replace(
        "_Reach] = End", "_Reach] = Line1"
    )
    _, findings = check_text(text, "a", types)
    errors = [f for f in findings if f.severity == "error"]
    assert {f.code for f in errors} == {"no-way-to-end"}
    assert [_points_at(text, f) for f in errors] == ["Approach1", "Line1", "Retract1", "Choose1"]


def test_an_event_that_cannot_happen_is_no_way_out(good: str, types: Registry) -> None:
    """A transition on a Timeout that is not set leads nowhere, so it is no way to an end."""
    text = good.replace("= Retract1;", "= Line1; TRANSITION[Timeout] = End;")
    _, findings = check_text(text, "a", types)
    assert sorted({f.code for f in findings if f.line < 30}) == [
        "impossible-event",
        "no-way-to-end",
    ]


def test_zero_time_self_loop(good: str, types: Registry) -> None:
    """A node that needs no time and leads to itself is such a cycle too."""
    text = good.replace("[Again] = Approach1", "[Again] = Choose1")
    _, findings = check_text(text, "a", types)
    assert [f.code for f in findings] == ["zero-time-cycle"]
    assert "Choose1 -> Choose1" in findings[0].message


def test_no_nodes(types: Registry) -> None:
    """An empty program says everything it lacks."""
    for text in ("", "% nothing\n\n"):
        program, findings = check_text(text, "empty.hds", types)
        assert program is None
        assert {f.code for f in findings} == {"missing-interface", "missing-initial", "no-nodes"}
        assert render(findings)


def test_all_findings_at_once_in_order_of_place(good: str, types: Registry) -> None:
    """Lexical, syntactic and semantic errors of one text are reported together, sorted."""
    text = good
    for old, new in [
        ("Force = 200;", "Froce = 200;"),
        ("Filter = 4;", "Filter 4;"),
        ("Length = 50;", "Length = 50 N"),
        ("Direction = 225;", "Direction = 999;"),
        ("= Retract1;\nEND", "= Retrct1;\nEDN"),
        ("Mode = Soft;", "Mode = Soft; § = 3;"),
        ("TYPE = Rest;", "TYPE = Rset"),
    ]:
        assert old in text
        text = text.replace(old, new, 1)
    program, findings = check_text(text, "bad.hds", types)
    assert program is None
    assert [(f.line, f.code) for f in findings] == [
        (8, "unknown-parameter"),
        (9, "syntax"),
        (21, "wrong-dimension"),
        (21, "missing-semicolon"),
        (22, "out-of-range"),
        (27, "unknown-target"),
        (28, "misspelt-keyword"),
        (34, "unexpected-character"),
        (47, "unknown-type"),
        (47, "missing-semicolon"),
    ], render(findings)


def test_rendering_underlines_the_place_under_tabs(good: str, types: Registry) -> None:
    """The caret line repeats tabs, so it stands right in every terminal."""
    text = good.replace("    Length = 50;", "\tLength\t= 50 N; % x")
    _, findings = check_text(text, "bad.hds", types)
    assert findings[0].render().splitlines() == [
        "bad.hds:21:14: error[wrong-dimension]: 'Length' is a length, but 'N' is a unit of force",
        "   21 | \tLength\t= 50 N; % x",
        "      | \t      \t     ^",
        "      = help: units of length: m, cm, mm, um",
    ]


def test_a_finding_is_plain_data(good: str, types: Registry) -> None:
    """``asdict`` gives what a machine-readable report needs."""
    _, findings = check_text(good.replace("Force = 200;", "Froce = 200;"), "bad.hds", types)
    data = asdict(findings[0])
    assert data["code"] == "unknown-parameter"
    assert (data["file"], data["line"], data["column"], data["length"]) == ("bad.hds", 8, 5, 5)


def test_every_keyword_is_refused_as_a_name(good: str, types: Registry) -> None:
    """No keyword can be a node's name, and saying so is the only finding there."""
    for keyword in KEYWORDS:
        text = good.replace("BEGIN\n    NAME = Rest1;", f"BEGIN\n    NAME = {keyword};", 1)
        _, findings = check_text(text, "a", types)
        assert [(f.code, f.line) for f in findings if f.line > 43] == [("syntax", 46)]
