"""Text to syntax tree. Every error is reported and reading goes on at the next statement.

What is left out or guessed while reading on only serves to find more errors: a source with an
error in it is never run.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from functools import cache
from importlib.resources import files

from lark import Lark, Token, UnexpectedToken

from arm.hds import syntax
from arm.hds.build import Build
from arm.hds.finding import Report
from arm.hds.names import nearest
from arm.hds.structure import Structure

KEYWORDS = (
    "INTERFACE",
    "INITIAL",
    "ABORT",
    "CONSTANT",
    "INCLUDE",
    "BEGIN",
    "END",
    "NAME",
    "TYPE",
    "LIKE",
    "TRANSITION",
)
"""Words with a meaning of their own; nothing else may be called so."""

_SPOKEN = {
    "EQUAL": "'='",
    "SEMICOLON": "';'",
    "LBRACKET": "'['",
    "RBRACKET": "']'",
    "SLASH": "'/'",
    "STAR": "'*'",
    "CARET": "'^'",
    "COMPARE": "a comparison",
    "WORD": "a name",
    "NUMBER": "a number",
    "STRING": "a quoted string",
}
_JUNK = ("UNTERMINATED", "UNEXPECTED")


@cache
def grammar() -> Lark:
    """The parser made from ``grammar.lark``; start rules ``statement`` and ``program``."""
    text = files("arm.hds").joinpath("grammar.lark").read_text(encoding="utf-8")
    return Lark(
        text,
        parser="lalr",
        lexer="basic",  # the text is lexed before anything is known to be wrong
        start=["statement", "program", "junk"],
    )


def parse(text: str, report: Report, file: str = "") -> syntax.Source:
    """Read a text; lexical and syntactic findings go to ``report``.

    Args:
        text: the source.
        report: where findings go.
        file: name of an included file, known to ``report``; empty for the program itself.
    """
    structure = Structure(report, included=bool(file))
    build = Build(file)
    for tokens in _statements(list(grammar().lex(text))):
        statement = _read(tokens, build, report)
        if statement is None:
            structure.unreadable()
        else:
            structure.add(statement, build.span(tokens[0]))
    return structure.finish()


def _statements(tokens: list[Token]) -> Iterator[list[Token]]:
    """Cut the tokens into statements: behind ';', around BEGIN and END, where one plainly starts.

    A name or keyword never stands inside a correct statement in the way ``_starts`` looks for, so
    a cut there only ever separates a broken statement from the one after it.
    """
    statement: list[Token] = []
    for i, token in enumerate(tokens):
        following = tokens[i + 1].type if i + 1 < len(tokens) else ""
        if statement and _starts(token, statement, following):
            yield statement
            statement = []
        statement.append(token)
        alone = len(statement) == 1 and token.type in ("BEGIN", "END")
        if alone or token.type == "SEMICOLON":
            yield statement
            statement = []
    if statement:
        yield statement


def _starts(token: Token, statement: list[Token], following: str) -> bool:
    """Whether a statement starts here though the one before it has not ended."""
    previous = statement[-1].type
    if token.type in KEYWORDS:
        # a keyword in a name's place (NAME = END;) is that statement's error
        in_place_of_name = previous in ("EQUAL", "LBRACKET", "CONSTANT")
        return not (in_place_of_name and following in ("SEMICOLON", "RBRACKET", "EQUAL"))
    if token.type != "WORD" or following not in ("EQUAL", "LBRACKET"):
        return False
    if len(statement) == 1 and _meant(statement[0], "CONSTANT"):
        return False
    types = [t.type for t in statement]
    if "COMPARE" in types and "RBRACKET" not in types:
        return False  # TRANSITION[Force > 5 N = Line1; lacks its bracket
    return previous not in (*KEYWORDS, *_JUNK, "LBRACKET")


def _read(tokens: list[Token], build: Build, report: Report) -> syntax.Statement | None:
    """One statement from its tokens; None, with a finding, if it cannot be read."""
    if _report_junk(tokens, build, report):
        return None
    tokens = _respell(tokens, build, report)
    parser = grammar().parse_interactive(start="statement")
    for i, token in enumerate(tokens):
        expected = parser.accepts() if len(tokens) == 1 else None
        try:
            parser.feed_token(token)
        except UnexpectedToken as error:
            expected = expected or error.expected
            if i == 0:
                message = f"no statement starts with {_found(token)}"
                help = f"a statement starts with a parameter's name or {', '.join(KEYWORDS)}"
            else:
                message = f"expected {_any_of(expected)}, found {_found(token)}"
                help = _help_for(tokens, token)
            report.error("syntax", message, build.span(token), help)
            return None
    last = tokens[-1]
    if last.type not in ("SEMICOLON", "BEGIN", "END"):
        accepted = parser.accepts()
        if "SEMICOLON" not in accepted:
            message = f"expected {_any_of(accepted)} after {_found(last)}"
            report.error("syntax", message, build.behind(last))
            return None
        message = f"';' is missing after {_found(last)}"
        report.error("missing-semicolon", message, build.behind(last), "a statement ends with ';'")
        parser.feed_token(Token.new_borrow_pos("SEMICOLON", ";", last))
    return build.statement(parser.feed_eof(tokens[-1]))


def _report_junk(tokens: list[Token], build: Build, report: Report) -> bool:
    junk = [t for t in tokens if t.type in _JUNK]
    foreign = 0
    for before, token in zip([None, *junk], junk, strict=False):
        if token.line == foreign:
            continue  # the rest of what was meant for a comment
        if token.type == "UNTERMINATED":
            message = "the string does not end on its line"
            report.error("unterminated-string", message, build.span(token), "close it with '\"'")
        elif before is None or (before.line, before.end_column) != (token.line, token.column):
            char = str(token)
            known = unicodedata.name(char, f"U+{ord(char):04X}").lower()
            shown = f"'{char}'" if char.isprintable() else "character"
            help = "a comment starts with '%'" if char in "#/!" else ""
            foreign = (token.line or 0) if help else foreign
            message = f"unexpected {shown} ({known})"
            report.error("unexpected-character", message, build.span(token), help)
    return bool(junk)


def _meant(token: Token, *keywords: str) -> str | None:
    """The keyword a word is nearly spelt like."""
    return nearest(token, keywords) if token.type == "WORD" else None


def _respell(tokens: list[Token], build: Build, report: Report) -> list[Token]:
    """A misspelt keyword that no name can be mistaken for is reported and read as it was meant."""
    first, rest = tokens[0], [t.type for t in tokens[1:]]
    if rest[:1] == ["LBRACKET"]:
        keyword = _meant(first, "TRANSITION")
    elif rest[:1] == ["STRING"]:
        keyword = _meant(first, "INCLUDE")
    elif rest[:2] == ["WORD", "EQUAL"]:
        keyword = _meant(first, "CONSTANT")
    elif rest in ([], ["SEMICOLON"]):
        keyword = _meant(first, "BEGIN", "END")
        tokens = tokens[:1] if keyword else tokens
    else:
        keyword = None
    if keyword is None:
        return tokens
    report.error(
        "misspelt-keyword",
        f"unknown keyword '{first}'",
        build.span(first),
        f"did you mean '{keyword}'?",
    )
    return [Token.new_borrow_pos(keyword, keyword, first), *tokens[1:]]


def _help_for(tokens: list[Token], token: Token) -> str:
    if token.type == "END" and tokens[0].type == "TRANSITION":
        return "the predefined terminal node is written 'End'"
    if token.type in KEYWORDS:
        return "keywords cannot be names"
    if token.type == "STRING":
        return "names are written without quotes"
    if tokens[0].type == "INCLUDE" and token.type == "WORD":
        return "the name of a file is written in quotes"
    if (
        tokens[0].type == "TRANSITION"
        and token.type == "EQUAL"
        and "COMPARE" not in {t.type for t in tokens}
    ):
        return (
            "a transition reads TRANSITION[event] = node; or TRANSITION[quantity > limit] = node;"
        )
    return ""


def _found(token: Token) -> str:
    return f"the keyword {token}" if token.type in KEYWORDS else f"'{token}'"


def _any_of(terminals: set[str]) -> str:
    spoken = [text for name, text in _SPOKEN.items() if name in terminals]
    # a unit may follow every number; naming its operators would bury what is missing
    spoken = [s for s in spoken if s not in ("'/'", "'*'", "'^'")] or spoken
    return " or ".join(spoken) or "nothing more"
