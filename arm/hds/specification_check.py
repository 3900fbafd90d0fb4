"""Reads a specification and checks it against the program it is for, all findings at once."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedInput

from arm.hds.check import ProgramError
from arm.hds.finding import Finding, Report
from arm.hds.names import hint
from arm.hds.nodetype import Registry
from arm.hds.program import ABORT, END, Program
from arm.hds.specification import ENTERED, FORBIDDEN, Rule, Specification, Symbol
from arm.hds.syntax import Span


@dataclass
class _State:
    place: Span
    names: list[Token] = field(default_factory=list)
    rules: list[tuple[list[tuple[Token, ...]], Token]] = field(default_factory=list)


@cache
def _grammar() -> Lark:
    text = files("arm.hds").joinpath("specification.lark").read_text(encoding="utf-8")
    return Lark(text, parser="lalr", propagate_positions=True, maybe_placeholders=False)


def check_specification(
    text: str, filename: str, program: Program, types: Registry
) -> tuple[Specification | None, list[Finding]]:
    """Read a specification of a program; None if there is any error, and all findings.

    Args:
        text: the source.
        filename: what findings call it.
        program: whose nodes the specification may name.
        types: whose types, events and quantities it may name.
    """
    report = Report(text, filename)
    try:
        tree = _grammar().parse(text)
    except UnexpectedInput as error:
        _syntax(error, report)
        return None, report.findings
    initials, blocks = _structure(tree, report)
    states: dict[str, tuple[Rule, ...]] = {}
    named = [block for block in blocks if block.names]
    valid = [*dict.fromkeys(str(block.names[0]) for block in named), FORBIDDEN]
    for block in named:
        name = block.names[0]
        if name == FORBIDDEN:
            message = f"'{FORBIDDEN}' is predefined and cannot be declared"
            report.error("reserved-name", message, _span(name))
        elif name in states:
            report.error("duplicate-node", f"a state called '{name}' is already there", _span(name))
        rules = tuple(_rules(block, valid, program, types, report))
        states.setdefault(str(name), rules)
    if not initials:
        message = "the specification does not say which state is first"
        report.error("missing-initial", message, Span(1, 1, 0), f"add INITIAL = {valid[0]};")
    for again in initials[1:]:
        report.error("duplicate-statement", "INITIAL is given twice", _span(again))
    if initials and initials[0] not in states:
        message = f"there is no state '{initials[0]}' to start with"
        report.error("unknown-initial", message, _span(initials[0]), hint(initials[0], valid[:-1]))
    if report.has_errors:
        return None, report.findings
    return Specification(states, str(initials[0]), filename), report.findings


def load_specification(path: str | Path, program: Program, types: Registry) -> Specification:
    """Read a specification file.

    Raises:
        ProgramError: it has an error; all findings are in it.
        OSError: it cannot be read.
    """
    text = Path(path).read_text(encoding="utf-8", errors="replace")
    made, findings = check_specification(text, str(path), program, types)
    if made is None:
        raise ProgramError(findings)
    return made


def _span(token: Token) -> Span:
    return Span(token.line or 1, token.column or 1, len(token))


def _syntax(error: UnexpectedInput, report: Report) -> None:
    token = getattr(error, "token", None)
    if (token is not None and token.type == "$END") or error.line is None or error.line < 1:
        report.error("syntax", "the file ends inside a statement", report.end)
        return
    length = len(token) if token is not None else 1
    report.error(
        "syntax",
        f"'{token if token is not None else getattr(error, 'char', '')}' cannot stand here",
        Span(error.line, error.column, length),
        "statements: INITIAL = state; BEGIN NAME = state; TRANSITION[what, ...] = state; END",
    )


def _structure(tree: Tree[Token], report: Report) -> tuple[list[Token], list[_State]]:
    """INITIAL's words, and what stands between each BEGIN and END."""
    initials: list[Token] = []
    blocks: list[_State] = []
    is_open = False
    for statement in tree.children:
        assert isinstance(statement, Tree)
        first = next(statement.scan_values(lambda value: isinstance(value, Token)))
        place = Span(statement.meta.line, statement.meta.column, len(first))
        if statement.data == "initial":
            initials.append(first)
        elif statement.data in ("begin", "end"):
            if (statement.data == "begin") == is_open:
                word = str(statement.data).upper()
                report.error("missing-end", f"{word} does not fit: is an END missing?", place)
            is_open = statement.data == "begin"
            if is_open:
                blocks.append(_State(place))
        elif not is_open:
            report.error("missing-begin", "this stands outside a state", place, "add BEGIN")
        elif statement.data == "name":
            blocks[-1].names.append(first)
        else:
            symbols, target = statement.children[:-1], statement.children[-1]
            assert isinstance(target, Tree)
            words = [tuple(s.children) for s in symbols if isinstance(s, Tree)]
            blocks[-1].rules.append((words, target.children[0]))  # type: ignore[arg-type]
    if is_open:
        report.error("missing-end", "this BEGIN has no END", blocks[-1].place)
    for block in blocks:
        if not block.names:
            report.error("missing-name", "this state has no NAME", block.place, "add NAME = ...;")
        for again in block.names[1:]:
            report.error("duplicate-statement", "NAME is given twice", _span(again))
    return initials, blocks


def _rules(
    block: _State, states: Collection[str], program: Program, types: Registry, report: Report
) -> Iterable[Rule]:
    for words, target in block.rules:
        if target not in states:
            message = f"there is no state '{target}' to go to"
            report.error("unknown-target", message, _span(target), hint(target, states))
        symbols = [_symbol(parts, program, types, report) for parts in words]
        line = words[0][0].line or 1
        yield Rule(tuple(s for s in symbols if s is not None), str(target), line)


def _symbol(
    parts: tuple[Token, ...], program: Program, types: Registry, report: Report
) -> Symbol | None:
    """What a word, or two with a dot, stands for; None, with a finding, if it is nothing."""
    places = [*program.nodes, END.name, *types]
    kinds = list(types.values())
    if len(parts) == 2:
        place, name = parts
        if place not in places:
            message = f"there is no node or node type '{place}'"
            report.error("unknown-node", message, _span(place), hint(place, places))
            return None
        if name == ENTERED:
            return Symbol(str(place), ENTERED)
        if place == END.name:
            message = f"nothing is raised in '{END.name}'"
            report.error("unknown-event", message, _span(name), f"write {END.name}")
            return None
        kind = types.get(program.nodes[place].type if place in program.nodes else place)
        kinds = [kind] if kind is not None else []
    raised = [n for kind in kinds for n in [*(e.name for e in kind.events)]]
    raised += [n for kind in kinds for n in [*(q.name for q in kind.offers)]]
    raised = list(dict.fromkeys([*raised, ABORT]))
    name = parts[-1]
    if len(parts) == 1 and name in places:
        if name in raised:
            message = f"'{name}' is a node or node type as well as an event"
            help = f"write {name}.{ENTERED} for the node, Node.{name} or Type.{name} for the event"
            report.error("ambiguous-name", message, _span(name), help)
            return None
        return Symbol(str(name), ENTERED)
    if name not in raised:
        valid = raised if len(parts) == 2 else [*program.nodes, *raised, END.name, *types]
        where = f"in '{parts[0]}'" if len(parts) == 2 else "in this program"
        message = f"nothing called '{name}' happens {where}"
        report.error("unknown-event", message, _span(name), hint(name, valid))
        return None
    return Symbol(str(parts[0]) if len(parts) == 2 else "", str(name))
