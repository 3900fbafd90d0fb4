"""docs/language.md says what the checker does."""

import re
from pathlib import Path

import arm.hds
from arm.hds import Registry, check_text, render

DOC = (Path(__file__).parents[3] / "docs" / "language.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```\w*\n(.*?)^```$", DOC, flags=re.DOTALL | re.MULTILINE)


def test_the_table_lists_every_code_with_its_severity() -> None:
    """The documented codes are the very ones in the source."""
    source = "".join(p.read_text("utf-8") for p in Path(arm.hds.__file__).parent.glob("*.py"))
    reported = set(re.findall(r'report\.(error|warning)\(\s*"([a-z0-9-]+)"', source))
    documented = {(s, code) for code, s in re.findall(r"^\| `([a-z0-9-]+)` \| (\w+) \|", DOC, re.M)}
    assert documented == reported


def test_the_first_example_has_no_findings(types: Registry) -> None:
    """The program the document opens with is good."""
    program, findings = check_text(BLOCKS[0], "doc", types)
    assert program is not None and findings == []


def test_the_errors_shown_are_real_output(types: Registry) -> None:
    """The faulty example gives exactly the output printed below it."""
    faulty, shown = BLOCKS[1:3]
    _, findings = check_text(faulty, "bad.hds", types)
    assert render(findings) == shown.rstrip("\n")
