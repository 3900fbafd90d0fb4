"""Text to syntax tree. Every error is reported and reading goes on at the next statement.

What is left out or guessed while reading on only serves to find more errors: a source with an
error in it is never run.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from functools import cache
from importlib.resources import files

from lark import Lark, Token, Tree, UnexpectedToken

from arm.hds import syntax
from arm.hds.finding import Report
from arm.hds.names import nearest
from arm.hds.structure import Structure
from arm.hds.syntax import Name, Number, Span, Word

KEYWORDS = ("INTERFACE", "INITIAL", "BEGIN", "END", "NAME", "TYPE", "TRANSITION")
"""Words with a meaning of their own; nothing else may be called so."""

_SPOKEN = {
    "EQUAL": "'='",
    "SEMICOLON": "';'",
    "LBRACKET": "'['",
    "RBRACKET": "']'",
    "SLASH": "'/'",
    "STAR": "'*'",
    "CARET": "'^'",
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


def parse(text: str, report: Report) -> syntax.Source:
    """Read a program; lexical and syntactic findings go to ``report``."""
    structure = Structure(report)
    for tokens in _statements(list(grammar().lex(text))):
        statement = _read(tokens, report)
        if statement is None:
            structure.unreadable()
        else:
            structure.add(statement, _span(tokens[0]))
    return structure.finish()


def _statements(tokens: list[Token]) -> Iterator[list[Token]]:
    """Cut the tokens into statements: behind ';', around BEGIN and END, where one plainly starts.

    A name or keyword never stands inside a correct statement in the way ``_starts`` looks for, so
    a cut there only ever separates a broken statement from the one after it.
    """
    statement: list[Token] = []
    for i, token in enumerate(tokens):
        following = tokens[i + 1].type if i + 1 < len(tokens) else ""
        if statement and _starts(token, statement[-1].type, following):
            yield statement
            statement = []
        statement.append(token)
        alone = len(statement) == 1 and token.type in ("BEGIN", "END")
        if alone or token.type == "SEMICOLON":
            yield statement
            statement = []
    if statement:
        yield statement


def _starts(token: Token, previous: str, following: str) -> bool:
    """Whether a statement starts here though the one before it has not ended."""
    if token.type in KEYWORDS:
        # a keyword in a name's place (NAME = END;) is that statement's error
        in_place_of_name = previous in ("EQUAL", "LBRACKET")
        return not (in_place_of_name and following in ("SEMICOLON", "RBRACKET"))
    if token.type == "WORD" and following in ("EQUAL", "LBRACKET"):
        return previous not in (*KEYWORDS, *_JUNK, "LBRACKET")
    return False


def _read(tokens: list[Token], report: Report) -> syntax.Statement | None:
    """One statement from its tokens; None, with a finding, if it cannot be read."""
    if _report_junk(tokens, report):
        return None
    tokens = _respell(tokens, report)
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
            report.error("syntax", message, _span(token), help)
            return None
    last = tokens[-1]
    if last.type not in ("SEMICOLON", "BEGIN", "END"):
        accepted = parser.accepts()
        if "SEMICOLON" not in accepted:
            message = f"expected {_any_of(accepted)} after {_found(last)}"
            report.error("syntax", message, _behind(last))
            return None
        message = f"';' is missing after {_found(last)}"
        report.error("missing-semicolon", message, _behind(last), "a statement ends with ';'")
        parser.feed_token(Token.new_borrow_pos("SEMICOLON", ";", last))
    return _build(parser.feed_eof(tokens[-1]))


def _report_junk(tokens: list[Token], report: Report) -> bool:
    junk = [t for t in tokens if t.type in _JUNK]
    for before, token in zip([None, *junk], junk, strict=False):
        if token.type == "UNTERMINATED":
            message = "the string does not end on its line"
            report.error("unterminated-string", message, _span(token), "close it with '\"'")
        elif before is None or (before.line, before.end_column) != (token.line, token.column):
            char = str(token)
            known = unicodedata.name(char, f"U+{ord(char):04X}").lower()
            shown = f"'{char}'" if char.isprintable() else "character"
            help = "a comment starts with '%'" if char in "#/!" else ""
            message = f"unexpected {shown} ({known})"
            report.error("unexpected-character", message, _span(token), help)
    return bool(junk)


def _respell(tokens: list[Token], report: Report) -> list[Token]:
    """A misspelt BEGIN, END or TRANSITION is reported and then read as what was meant."""
    first, rest = tokens[0], [t.type for t in tokens[1:]]
    if first.type != "WORD":
        return tokens
    if rest[:1] == ["LBRACKET"]:
        keyword = nearest(first, ["TRANSITION"])
    elif rest in ([], ["SEMICOLON"]):
        keyword = nearest(first, ["BEGIN", "END"])
        tokens = tokens[:1] if keyword else tokens
    else:
        keyword = None
    if keyword is None:
        return tokens
    report.error(
        "misspelt-keyword", f"unknown keyword '{first}'", _span(first), f"did you mean '{keyword}'?"
    )
    return [Token.new_borrow_pos(keyword, keyword, first), *tokens[1:]]


def _help_for(tokens: list[Token], token: Token) -> str:
    if token.type == "END" and tokens[0].type == "TRANSITION":
        return "the predefined terminal node is written 'End'"
    if token.type in KEYWORDS:
        return "keywords cannot be names"
    if token.type == "STRING":
        return "names are written without quotes"
    return ""


def _build(tree: Tree[Token]) -> syntax.Statement:
    """The syntax tree of one statement from lark's."""
    parts = tree.children
    match tree.data:
        case "interface":
            return syntax.Interface(_name(parts[2]))
        case "initial":
            return syntax.Initial(_name(parts[2]))
        case "begin":
            return syntax.Begin(_name(parts[0]).span)
        case "end":
            return syntax.End(_name(parts[0]).span)
        case "name":
            return syntax.NodeName(_name(parts[2]))
        case "type":
            return syntax.TypeName(_name(parts[2]))
        case "parameter":
            return syntax.Assignment(_name(parts[0]), _value(parts[2]))
        case "transition":
            return syntax.Transition(_name(parts[2]), _name(parts[5]))
    raise AssertionError(f"grammar.lark has a statement nobody builds: {tree.data}")


def _value(tree: Token | Tree[Token]) -> syntax.Value:
    assert isinstance(tree, Tree)
    first = _name(tree.children[0])
    if tree.data == "word":
        return Word(first.text, first.span)
    unit = None
    if len(tree.children) > 1:
        expression = tree.children[1]
        assert isinstance(expression, Tree)
        pieces = [p for p in expression.children if isinstance(p, Token)]
        joined = "".join(
            f" {p}" if i and p.type == "WORD" and pieces[i - 1].type in ("WORD", "NUMBER") else p
            for i, p in enumerate(pieces)
        )
        start, end = _span(pieces[0]), pieces[-1]
        if end.line == start.line and end.end_column:
            start = Span(start.line, start.column, end.end_column - start.column)
        unit = Name(joined, start)
    return Number(first.text, unit, first.span)


def _name(token: Token | Tree[Token]) -> Name:
    assert isinstance(token, Token)
    return Name(str(token).strip('"') if token.type == "STRING" else str(token), _span(token))


def _span(token: Token) -> Span:
    return Span(token.line or 1, token.column or 1, len(token))


def _behind(token: Token) -> Span:
    return Span(token.line or 1, (token.column or 1) + len(token), 0)


def _found(token: Token) -> str:
    return f"the keyword {token}" if token.type in KEYWORDS else f"'{token}'"


def _any_of(terminals: set[str]) -> str:
    spoken = [text for name, text in _SPOKEN.items() if name in terminals]
    # a unit may follow every number; naming its operators would bury what is missing
    spoken = [s for s in spoken if s not in ("'/'", "'*'", "'^'")] or spoken
    return " or ".join(spoken) or "nothing more"
