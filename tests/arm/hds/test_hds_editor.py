"""The editors' grammar colours programs as the parser reads them.

Both are asked about every character of every good program: keyword, number, unit, comment, string
or something else. The TextMate grammar is run by the rules of TextMate: at each place of a line
the pattern that matches earliest, of several the first in the list, takes what it matches.
"""

import json
import re
from pathlib import Path

import pytest
from lark import Token, Tree

from arm.hds.parser import KEYWORDS, grammar

ROOT = Path(__file__).parents[3]
EXTENSION = ROOT / "deploy" / "editors" / "vscode"
SYNTAX = json.loads((EXTENSION / "syntaxes" / "hds.tmLanguage.json").read_text("utf-8"))
GOOD = [
    *sorted((Path(__file__).parent / "corpus" / "good").glob("*.hds")),
    *sorted((ROOT / "arm" / "programs").glob("*.hds")),
]
CLASSES = {
    "keyword.control": "keyword",
    "constant.numeric": "number",
    "keyword.other.unit": "unit",
    "comment": "comment",
    "string": "string",
}


def by_parser(text: str) -> list[str]:
    """What each character is for the parser; blanks are ``other``."""
    marks = ["comment" if not c.isspace() else "other" for c in text]

    def mark(start: int, end: int, what: str) -> None:
        for i in range(start, end):
            marks[i] = what if not text[i].isspace() else "other"

    kinds = {"NUMBER": "number", "STRING": "string"} | dict.fromkeys(KEYWORDS, "keyword")
    for token in grammar().lex(text):
        assert token.start_pos is not None and token.end_pos is not None
        mark(token.start_pos, token.end_pos, kinds.get(token.type, "other"))
    for tree in grammar().parse(text, start="program").find_data("unit"):
        tokens = [t for t in tree.children if isinstance(t, Token)]
        assert isinstance(tree, Tree)
        first, last = tokens[0].start_pos, tokens[-1].end_pos
        assert first is not None and last is not None
        mark(first, last, "unit")
    # inside a comment the blanks are no more than anywhere
    return marks


def by_editor(text: str) -> list[str]:
    """What each character is for an editor; blanks are ``other``."""
    marks: list[str] = []
    patterns = [(re.compile(p["match"]), p) for p in SYNTAX["patterns"]]
    for line in text.splitlines(keepends=True):
        row, at = ["other"] * len(line), 0
        while at < len(line):
            found = [
                (m.start(), i, m) for i, (p, _) in enumerate(patterns) if (m := p.search(line, at))
            ]
            if not found:
                break
            _, i, match = min(found, key=lambda f: f[:2])
            rule = patterns[i][1]
            groups = {0: rule.get("name", "")} | {
                int(n): c["name"] for n, c in rule.get("captures", {}).items()
            }
            for group, scope in groups.items():
                what = next((w for s, w in CLASSES.items() if scope.startswith(s)), "other")
                for k in range(*match.span(group)) if match.span(group)[0] >= 0 else ():
                    row[k] = what if not line[k].isspace() else "other"
            assert match.end() > at, rule
            at = match.end()
        marks += row
    return marks


@pytest.mark.parametrize("path", GOOD, ids=[p.stem for p in GOOD])
def test_editor_and_parser_see_the_same(path: Path) -> None:
    """Every character of a good program is of the same kind for both."""
    text = path.read_text(encoding="utf-8")
    wrong = [
        (text.count("\n", 0, i) + 1, text[i], one, other)
        for i, (one, other) in enumerate(zip(by_parser(text), by_editor(text), strict=True))
        if one != other
    ]
    assert not wrong


def test_every_kind_is_seen() -> None:
    """The programs compared have every kind in them, and every keyword."""
    texts = [path.read_text(encoding="utf-8") for path in GOOD]
    assert {mark for text in texts for mark in by_parser(text)} == {*CLASSES.values(), "other"}
    assert all(any(re.search(rf"\b{k}\b", text) for text in texts) for k in KEYWORDS)


def test_the_extension_knows_the_very_keywords() -> None:
    """A keyword added to the language has to be added to the editors' grammar."""
    control = next(p for p in SYNTAX["patterns"] if p.get("name") == "keyword.control.hds")
    assert tuple(re.findall(r"[A-Z]+", control["match"])) == KEYWORDS
    number = next(p for p in SYNTAX["patterns"] if "captures" in p)
    assert f"(?:{'|'.join(KEYWORDS)})" in number["match"]


def test_a_word_on_the_next_statement_is_no_unit() -> None:
    """A missing ';' does not colour the keyword behind a number as a unit."""
    line = "Speed = 40 END"
    assert by_editor(line)[-3:] == ["keyword"] * 3


def test_the_extension_points_at_its_files() -> None:
    """What the manifest names is there."""
    manifest = json.loads((EXTENSION / "package.json").read_text("utf-8"))["contributes"]
    paths = [manifest["languages"][0]["configuration"], manifest["grammars"][0]["path"]]
    assert all(json.loads((EXTENSION / path).read_text("utf-8")) for path in paths)
    assert manifest["grammars"][0]["scopeName"] == SYNTAX["scopeName"]
