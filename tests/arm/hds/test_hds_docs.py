"""docs/language.md says what the checker does."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import arm.hds
from arm.hds import Automaton, check_text, render
from arm.hds.specification_check import check_specification
from arm.nodes import REGISTRY
from services.cli.main import app

DOC = (Path(__file__).parents[3] / "docs" / "language.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```\w*\n(.*?)^```$", DOC, flags=re.DOTALL | re.MULTILINE)


def test_the_table_lists_every_code_with_its_severity() -> None:
    """The documented codes are the very ones in the source, of language, node types and shell."""
    root = Path(arm.hds.__file__).parents[2]
    files = [
        *root.glob("arm/hds/*.py"),
        *root.glob("arm/nodes/*.py"),
        *root.glob("services/cli/*.py"),
    ]
    # a specification is no program
    source = "".join(p.read_text("utf-8") for p in files if not p.stem.startswith("specification"))
    reported = set(re.findall(r'report\.(error|warning)\(\s*"([a-z0-9-]+)"', source))
    reported |= set(re.findall(r'Finding\(\s*"(error|warning)", "([a-z0-9-]+)"', source))
    documented = {(s, code) for code, s in re.findall(r"^\| `([a-z0-9-]+)` \| (\w+) \|", DOC, re.M)}
    assert documented == reported


def test_the_first_example_has_no_findings() -> None:
    """The program the document opens with is good."""
    program, findings = check_text(BLOCKS[0], "doc", REGISTRY)
    assert program is not None and findings == []


def test_the_guarded_example_has_no_findings() -> None:
    """And it has what the text around it speaks of."""
    text = next(block for block in BLOCKS if "LIKE" in block)
    program, findings = check_text(text, "doc", REGISTRY)
    assert findings == [] and program is not None
    assert program.abort == "Retract1"
    assert [g.text for g in program.nodes["Line2"].guards] == ["Force > Too_hard", "Force < 0.1 N"]
    assert program.nodes["Line2"].transitions == {"Finished": "Retract1"}
    assert program.nodes["Missed"].terminal


def test_the_specifications_fit_the_guarded_example() -> None:
    """Each can be read for that program: it names nothing that is not there."""
    program, _ = check_text(next(b for b in BLOCKS if "LIKE" in b), "doc", REGISTRY)
    assert program is not None
    specifications = [block for block in BLOCKS if "Forbidden" in block and "BEGIN" in block]
    assert len(specifications) == 2
    for text in specifications:
        assert check_specification(text, "doc", program, REGISTRY)[1] == []


def test_every_command_in_the_document_is_there(tmp_path: Path) -> None:
    """With the options it is shown with; a command line tells of its own options."""
    commands = {
        (words[0], words[1]) if words[0] == "program" else (words[0],): words
        for line in re.findall(r"steadyhand ([a-z][^`\n#]*)", DOC)
        if (words := line.split())
    }
    assert {c[1] for c in commands if c[0] == "program"} >= {"check", "graph", "step", "verify"}
    for command, words in commands.items():
        result = CliRunner().invoke(app, [*command, "--help"])
        assert result.exit_code == 0, command
        options = {w.strip("[]") for w in words if w.startswith(("--", "[--"))}
        assert all(option in result.output for option in options), words


def test_the_python_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the document shows of the library works as written."""
    (tmp_path / "stroke.hds").write_text(
        "INTERFACE = r1; INITIAL = A; ABORT = A; "
        "BEGIN NAME = A; TYPE = Whiteboard_line; Length = 50; "
        "TRANSITION[Finished] = A2; TRANSITION[Time > 1] = A2; END "
        "BEGIN NAME = A2; LIKE = A; TRANSITION[Finished] = End; END"
    )
    monkeypatch.chdir(tmp_path)
    code = re.findall(r"^```python\n(.*?)^```$", DOC, flags=re.DOTALL | re.MULTILINE)
    assert len(code) == 1
    names: dict[str, object] = {}
    exec(code[0], names)
    automaton = names["automaton"]
    assert isinstance(automaton, Automaton)
    assert [step.target for step in automaton.history] == ["A", "A2", "A2", "A"]


def test_every_program_in_the_document_is_judged_here() -> None:
    """No example has findings but the one that shows them, which a new one would have to join."""
    programs = [block for block in BLOCKS if "INTERFACE" in block and "BEGIN" in block]
    verdicts = [check_text(block, "doc", REGISTRY)[1] == [] for block in programs]
    assert verdicts == [True, True, False]


def test_the_errors_shown_are_real_output() -> None:
    """The faulty example gives exactly the output printed below it."""
    at = next(i for i, block in enumerate(BLOCKS) if block.startswith("bad.hds:"))
    faulty, shown = BLOCKS[at - 1], BLOCKS[at]
    _, findings = check_text(faulty, "bad.hds", REGISTRY)
    assert render(findings) == shown.rstrip("\n")
