"""Broken programs, each in its own file, give the findings written in it; good ones give none.

A line ``% expect: 7:15 wrong-dimension`` in a program is a finding at line 7, column 15;
``% expect: parts/x.hds:7:15 ...`` is one in an included file.
"""

import re
from pathlib import Path

import pytest

from arm.hds import Registry, check_text, render

CORPUS = Path(__file__).parent / "corpus"
BROKEN = sorted(CORPUS.glob("*.hds"))
GOOD = sorted((CORPUS / "good").glob("*.hds"))
EXPECT = re.compile(r"^% expect: (?:(\S+?):)?(\d+):(\d+) (\S+)$", re.MULTILINE)
DOC = (Path(__file__).parents[3] / "docs" / "language.md").read_text(encoding="utf-8")
DOCUMENTED = dict(re.findall(r"^\| `([a-z0-9-]+)` \| (\w+) \|", DOC, re.MULTILINE))


def expected(text: str) -> list[tuple[str, int, int, str]]:
    """The findings a program says it has: file, line, column, code."""
    return [(f, int(line), int(col), code) for f, line, col, code in EXPECT.findall(text)]


@pytest.mark.parametrize("path", BROKEN, ids=[p.stem for p in BROKEN])
def test_a_broken_program_is_refused_for_its_reason(path: Path, types: Registry) -> None:
    """Exactly the expected findings, at their places; the first code names the file."""
    text = path.read_text(encoding="utf-8")
    program, findings = check_text(text, str(path), types)
    here = str(path.parent) + "/"
    found = [
        (f.file.removeprefix(here) if f.file != str(path) else "", f.line, f.column, f.code)
        for f in findings
    ]
    assert found == expected(text), render(findings)
    assert path.stem.startswith(expected(text)[-1][3])
    assert (program is None) == any(f.severity == "error" for f in findings)
    for finding in findings:
        assert finding.severity == DOCUMENTED[finding.code]
        assert finding.message and finding.render().count("\n") >= 2


@pytest.mark.parametrize("path", GOOD, ids=[p.stem for p in GOOD])
def test_a_good_program_has_no_findings(path: Path, types: Registry) -> None:
    """No error and no warning."""
    program, findings = check_text(path.read_text(encoding="utf-8"), str(path), types)
    assert findings == [], render(findings)
    assert program is not None


def test_every_documented_finding_has_its_program() -> None:
    """The corpus covers the table of the documentation, and has no fewer than 60 programs."""
    covered = {e[3] for path in BROKEN for e in expected(path.read_text(encoding="utf-8"))}
    # found when nodes are made and files are opened, not by the language
    assert covered == set(DOCUMENTED) - {"unusable", "unreadable"}
    assert len(BROKEN) >= 60
