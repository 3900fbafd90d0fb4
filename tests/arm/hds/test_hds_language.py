"""What the language means: the paper's fragment, units, defaults, loading."""

import hashlib
import math
from pathlib import Path

import pytest
from lark import LarkError

from arm.hds import ProgramError, Registry, check_text, load
from arm.hds.parser import grammar


def test_paper_fragment_runs_as_printed(paper: str, good: str, types: Registry) -> None:
    """The printed fragment is accepted unchanged and bare numbers mean what the paper says."""
    assert paper in good
    program, findings = check_text(good, "whiteboard.hds", types)
    assert findings == []
    assert program is not None
    approach, line = program.nodes["Approach1"], program.nodes["Line1"]
    assert approach.type == "Whiteboard_approach"
    assert approach.parameters == {
        "Force": 2.0,
        "Filter": 4,
        "MaxX": 0.7,
        "Speed": 0.02,
        "Timeout": math.inf,
    }
    assert approach.transitions == {"Contact": "Line1", "Out_of_Reach": "End"}
    assert line.parameters["Length"] == 0.05
    assert line.parameters["Direction"] == pytest.approx(math.radians(225), rel=1e-15)
    assert line.parameters["Force"] == 1.5
    assert line.parameters["FGain"] == 0.02
    assert (program.interface, program.initial, program.path) == (
        "r1",
        "Approach1",
        "whiteboard.hds",
    )
    assert list(program.nodes) == ["Approach1", "Line1", "Retract1", "Choose1", "Rest1"]
    assert [n.name for n in program.nodes.values() if n.terminal] == ["Rest1"]


def test_written_units_and_bare_numbers_mean_the_same(good: str, types: Registry) -> None:
    """A unit written out gives the very same double as the default unit."""
    written = good
    for bare, unit in [
        ("Force = 200;", "Force = 2 N;"),
        ("MaxX = 700;", "MaxX = 70cm;"),
        ("Speed = 20;", "Speed = 0.02 m / s;"),
        ("Length = 50;", "Length = 5e-2 m;"),
        ("Direction = 225;", "Direction = 225 deg;"),
        ("FGain = 0.00002;", "FGain = 0.02 m/s/N;"),
    ]:
        assert bare in written
        written = written.replace(bare, unit, 1)
    one, _ = check_text(good, "a", types)
    two, _ = check_text(written, "a", types)
    assert one is not None and two is not None
    assert one.nodes == two.nodes
    assert one.sha256 != two.sha256


@pytest.mark.parametrize(
    ("value", "si"),
    [("2 N m", 2.0), ("2 N*m", 2.0), ("2Nm", 2.0), ("500 mN m", 0.5), ("1e2 N cm", 1.0)],
)
def test_torque_spellings(value: str, si: float, good: str, types: Registry) -> None:
    """A product of units may be written with a blank, a star, or as one symbol."""
    text = good.replace("Mode = Soft;", f"Torque = {value};")
    program, findings = check_text(text, "a", types)
    assert findings == [] and program is not None
    assert program.nodes["Retract1"].parameters["Torque"] == si


def test_words_may_be_plain_or_quoted(good: str, types: Registry) -> None:
    """Quoting changes nothing about a word but what it may contain."""
    text = good.replace("Mode = Soft;", 'Mode = "Soft"; Label = "left; % hand";')
    program, findings = check_text(text, "a", types)
    assert findings == [] and program is not None
    assert program.nodes["Retract1"].parameters["Mode"] == "Soft"
    assert program.nodes["Retract1"].parameters["Label"] == "left; % hand"


def test_layout_does_not_matter(good: str, types: Registry) -> None:
    """Line ends, tabs, a byte-order mark and missing blanks change no node."""
    dense = " ".join(line.split("%")[0].strip() for line in good.splitlines())
    expected, _ = check_text(good, "a", types)
    assert expected is not None
    for text in (good.replace("\n", "\r\n"), good.replace("    ", "\t"), "\ufeff" + good, dense):
        program, findings = check_text(text, "a", types)
        assert findings == [] and program is not None
        assert {n: (v.parameters, v.transitions) for n, v in program.nodes.items()} == {
            n: (v.parameters, v.transitions) for n, v in expected.nodes.items()
        }


def test_load_reads_a_file_and_digests_it(good: str, types: Registry, tmp_path: Path) -> None:
    """A loaded program carries its path and the digest sha256sum would print."""
    path = tmp_path / "good.hds"
    path.write_text(good, encoding="utf-8")
    program = load(path, types)
    assert program.path == str(path)
    assert program.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_load_refuses_with_the_full_rendering(good: str, types: Registry, tmp_path: Path) -> None:
    """A refused program's error shows every finding with its source line."""
    path = tmp_path / "bad.hds"
    path.write_text(good.replace("Speed = 20;", "Sped = 20;").replace("[Done]", "[Don]"))
    with pytest.raises(ProgramError) as caught:
        load(path, types)
    assert [f.code for f in caught.value.findings] == ["unknown-parameter", "unknown-event"]
    text = str(caught.value)
    assert f"{path}:11:5: error[unknown-parameter]:" in text
    assert "   11 |     Sped = 20; % Approach" in text
    assert "did you mean 'Speed'?" in text and "did you mean 'Done'?" in text
    assert text.endswith("2 errors, 0 warnings")


def test_load_says_where_a_file_is_not_utf8(types: Registry, tmp_path: Path) -> None:
    """A byte that is no UTF-8 is a finding with a place, not a traceback."""
    path = tmp_path / "latin.hds"
    path.write_bytes(b"% ok\nINTERFACE = r1; % \xe5ngstr\xf6m\n")
    with pytest.raises(ProgramError) as caught:
        load(path, types)
    (finding,) = caught.value.findings
    assert (finding.code, finding.line, finding.column) == ("encoding", 2, 19)


def test_warnings_travel_with_the_program(good: str, types: Registry) -> None:
    """A warning refuses nothing and is kept in the program."""
    text = good + "BEGIN NAME = Alone; TYPE = Rest; END\n"
    program, findings = check_text(text, "a", types)
    assert program is not None
    assert [f.code for f in findings] == ["unreachable-node"]
    assert program.warnings == tuple(findings)


def test_a_timeout_that_is_set_must_be_handled(good: str, types: Registry) -> None:
    """Setting the parameter an event needs makes the event possible, so it wants a transition."""
    text = good.replace("MaxX = 700;", "MaxX = 700; Timeout = 5;")
    _, findings = check_text(text, "a", types)
    assert [f.code for f in findings] == ["unhandled-event"]
    handled = text.replace(
        "[Out_of_Reach] = End;", "[Out_of_Reach] = End; TRANSITION[Timeout]=End;"
    )
    program, findings = check_text(handled, "a", types)
    assert findings == [] and program is not None
    assert program.nodes["Approach1"].parameters["Timeout"] == 5.0


def test_the_grammar_file_describes_whole_programs(good: str) -> None:
    """The rule ``program`` of grammar.lark accepts a good program and refuses a broken one."""
    grammar().parse(good, start="program")
    with pytest.raises(LarkError):
        grammar().parse(good + "END", start="program")
