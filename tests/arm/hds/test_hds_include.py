"""Constants, other files and nodes like others: what the checked program holds."""

import hashlib
from pathlib import Path

import pytest

from arm.hds import (
    Constant,
    Event,
    NodeType,
    Parameter,
    Program,
    ProgramError,
    Registry,
    check_text,
    load,
    registry,
)

CORPUS = Path(__file__).parent / "corpus"


@pytest.fixture(scope="module")
def included(types: Registry) -> Program:
    """A program that includes a file that includes another, which it includes as well."""
    return load(CORPUS / "good" / "include.hds", types)


def test_included_nodes_come_first_and_know_their_file(included: Program) -> None:
    """Each file is read once, innermost first, and nodes say where they stand."""
    strokes, fast = CORPUS / "parts" / "strokes.hds", CORPUS / "parts" / "fast.hds"
    assert list(included.nodes) == ["Stroke", "Fast_stroke", "Approach1", "Line1"]
    assert included.includes == (str(fast), str(strokes))
    assert included.nodes["Stroke"].file == str(strokes)
    assert included.nodes["Line1"].file == included.path
    assert included.nodes["Stroke"].line == 4


def test_a_chain_of_likes_reaches_across_files(included: Program) -> None:
    """Line1 is like Fast_stroke is like Stroke: the nearest setting counts."""
    line = included.nodes["Line1"].parameters
    assert (line["Force"], line["Speed"], line["Length"]) == (1.0, 0.1, 0.05)
    assert [g.text for g in included.nodes["Line1"].guards] == ["Force > 6 N"]
    assert Path(included.nodes["Line1"].guards[0].file).name == "strokes.hds"


def test_constants_are_listed_as_written(included: Program) -> None:
    """With their unit and place."""
    strokes = str(CORPUS / "parts" / "strokes.hds")
    assert included.constants == {
        "Stroke_speed": Constant("Stroke_speed", "40 mm/s", strokes, 2, 10)
    }


def test_the_digest_changes_with_an_included_file(types: Registry, tmp_path: Path) -> None:
    """Two programs with one text and different parts are not the same program."""
    text = 'INTERFACE = r1; INITIAL = A; INCLUDE "part.hds";'
    node = "BEGIN NAME = A; TYPE = Goto_pose; Speed = %d; TRANSITION[Finished] = End; END"
    digests = set()
    for speed in (10, 20):
        (tmp_path / "main.hds").write_text(text)
        (tmp_path / "part.hds").write_text(node % speed)
        digests.add(load(tmp_path / "main.hds", types).sha256)
    alone = text.replace('INCLUDE "part.hds";', node % 10)
    program, _ = check_text(alone, "alone.hds", types)
    assert program is not None
    assert program.sha256 == hashlib.sha256(alone.encode()).hexdigest()
    assert len(digests | {program.sha256}) == 3


def test_a_finding_in_an_included_file_shows_its_line(types: Registry) -> None:
    """Name, line, source line and caret are those of the included file."""
    with pytest.raises(ProgramError) as caught:
        load(CORPUS / "out-of-range-5.hds", types)
    (finding,) = caught.value.findings
    assert finding.file == str(CORPUS / "parts" / "wrong.hds")
    assert finding.render().splitlines()[1:3] == [
        "    5 |     Speed =  2 m/s;",
        "      |              ^^^^^",
    ]


@pytest.mark.parametrize("name", ["", ".", "/dev/null", "no\x00file", "a" * 300, "~/x.hds"])
def test_what_is_no_file_is_a_finding(name: str, types: Registry) -> None:
    """Folders, devices and impossible names are refused, never opened."""
    text = f'INTERFACE = r1; INITIAL = A; INCLUDE "{name}";'
    _, findings = check_text(text, "main.hds", types)
    assert [f.code for f in findings] == ["missing-include"]


def test_a_missing_file_is_one_finding_whatever_it_may_hold(types: Registry) -> None:
    """Names that may be in the file are not missed as well; other faults still show."""
    text = """INTERFACE = r1; INITIAL = Elsewhere; ABORT = Elsewhere; INCLUDE "gone.hds";
    BEGIN NAME = A; LIKE = Elsewhere; Speed = Fast; TRANSITION[Finished] = Elsewhere; END
    BEGIN NAME = B; TYPE = Goto_pose; Sped = 1; Speed = Fast; TRANSITION[Finished] = Away; END
    """
    _, findings = check_text(text, "main.hds", types)
    assert [f.code for f in findings] == ["missing-include", "unknown-parameter"]


def test_a_constant_without_a_unit_takes_that_of_its_place(types: Registry) -> None:
    """One number for a speed and a length is 40 mm/s and 40 mm."""
    text = """INTERFACE = r1; INITIAL = A; CONSTANT Forty = 40;
    BEGIN NAME = A; TYPE = Whiteboard_line; Length = Forty; Speed = Forty; Direction = Forty;
    Force = 150; TRANSITION[Finished] = End; END"""
    program, findings = check_text(text, "a", types)
    assert program is not None and findings == []
    values = program.nodes["A"].parameters
    assert (values["Length"], values["Speed"]) == (0.04, 0.04)


def test_a_quoted_word_is_never_a_constant(types: Registry) -> None:
    """Quotes keep a word what it is."""
    text = """INTERFACE = r1; INITIAL = A; CONSTANT Text = "other";
    BEGIN NAME = A; TYPE = Goto_pose; Speed = 100; Label = %s; TRANSITION[Finished] = End; END"""
    for written, label, warned in [('"Text"', "Text", True), ("Text", "other", False)]:
        program, findings = check_text(text % written, "a", types)
        assert program is not None and program.nodes["A"].parameters["Label"] == label
        assert [f.code for f in findings] == ["unused-constant"] * warned


def test_a_like_node_of_another_type_takes_over_what_that_has(types: Registry) -> None:
    """Its parameters, and guards on quantities it offers; the rest is left out."""
    text = """INTERFACE = r1; INITIAL = A;
BEGIN NAME = A; TYPE = Whiteboard_line; Length = 50; Speed = 40; Direction = 0; Force = 150;
    TRANSITION[Finished] = B; TRANSITION[Force > 5 N] = End; END
BEGIN NAME = B; LIKE = A; TYPE = Goto_pose; TRANSITION[Finished] = End; END"""
    program, findings = check_text(text, "a", types)
    assert findings == [] and program is not None
    assert set(program.nodes["B"].parameters) == {"Speed", "Mode", "Label", "Torque"}
    assert [g.text for g in program.nodes["B"].guards] == ["Force > 5 N"]


def test_a_value_the_other_type_does_not_allow_is_reported_at_the_like() -> None:
    """The place of the fault is where it is taken over: where it is written it is right."""
    done = (Event("Done"),)
    types = registry(
        NodeType("Fast", (Parameter("Speed", "mm/s", 0.0, 1.0),), done),
        NodeType("Slow", (Parameter("Speed", "mm/s", 0.0, 0.1),), done),
    )
    text = """INTERFACE = r1; INITIAL = A;
BEGIN NAME = A; TYPE = Fast; Speed = 0.5 m/s; TRANSITION[Done] = B; END
BEGIN NAME = B; LIKE = A; TYPE = Slow; TRANSITION[Done] = End; END"""
    _, (finding,) = check_text(text, "a", types)
    assert (finding.code, finding.line, finding.column) == ("out-of-range", 3, 24)


def test_long_chains_of_likes_are_followed(types: Registry) -> None:
    """A thousand nodes, each like the next, and none of it by recursion."""
    nodes = [
        f"BEGIN NAME = N{i}; LIKE = N{i + 1}; TRANSITION[Finished] = N{i + 1}; END"
        for i in range(1000)
    ]
    last = "BEGIN NAME = N1000; TYPE = Goto_pose; Speed = 7; TRANSITION[Finished] = End; END"
    text = "\n".join(["INTERFACE = r1; INITIAL = N0;", *nodes, last])
    program, findings = check_text(text, "a", types)
    assert findings == [] and program is not None
    assert program.nodes["N0"].parameters["Speed"] == 0.007
