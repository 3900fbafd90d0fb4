"""The check before anything moves: a program comes out without an error, or not at all."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from arm.hds.constants import Constants
from arm.hds.finding import Finding, Report, render
from arm.hds.flow import check_flow
from arm.hds.include import Includes, UnreadableText, read_text
from arm.hds.names import hint
from arm.hds.nodetype import Registry
from arm.hds.parser import parse
from arm.hds.program import END, Program
from arm.hds.scope import Scope
from arm.hds.semantics import check_nodes, node_names, only
from arm.hds.syntax import Source, Span


class ProgramError(ValueError):
    """A program that is refused; its text is the full rendering of ``findings``."""

    def __init__(self, findings: Sequence[Finding]) -> None:
        super().__init__(render(findings))
        self.findings = tuple(findings)


def check_text(
    text: str, filename: str, registry: Registry
) -> tuple[Program | None, list[Finding]]:
    """Check a program against the node types there are.

    Args:
        text: the source.
        filename: what findings call it; files it includes are looked for relative to it.
        registry: node types by name.

    Returns:
        The program, or None if there is any error; and all findings, in order of place.
    """
    whole, text = text, text.removeprefix("\ufeff")
    report = Report(text, filename)
    source = parse(text, report)
    includes = Includes(report)
    includes.merge(source)
    interface = only(source.interfaces, "INTERFACE", report)
    named = node_names(source, report)
    initial = _initial(source, list(named), report, includes.partial)
    abort = _abort(source, list(named), report, includes.partial)

    constants = Constants(source.constants, report, includes.partial)
    targets = dict.fromkeys([*named, END.name])  # found at once, listed in order
    scope = Scope(registry, targets, constants, report, includes.partial)
    # a node with somebody else's name or none is checked too, but nothing leads to it
    placed = {id(block) for block in named.values()}
    checks = check_nodes(source, named, scope)
    checked = {check.name: check for check in checks if id(check.block) in placed}
    if initial is not None and checked[initial].terminal:
        message = f"the program would end where it starts: '{initial}' is a terminal node"
        report.error("terminal-initial", message, source.initials[0].span)
        initial = None
    check_flow(checked, initial, abort, includes.partial, report)
    constants.report_unused()

    findings = report.findings
    if report.has_errors or interface is None or initial is None:
        return None, findings
    program = Program(
        {name: check.node(constants, report) for name, check in checked.items()},
        initial,
        interface.text,
        filename,
        _digest([whole, *includes.texts]),
        tuple(findings),
        constants.table,
        abort or END.name,
        tuple(includes.files),
    )
    return program, findings


def load(path: str | Path, registry: Registry) -> Program:
    """Read and check a program file.

    Raises:
        ProgramError: the program has an error; all findings are in it.
        OSError: the file cannot be read.
    """
    try:
        text = read_text(Path(path))
    except UnreadableText as error:
        report = Report(error.text, str(path))
        place = Span(error.line, error.column, 1)
        report.error("encoding", str(error), place, "save the file as UTF-8")
        raise ProgramError(report.findings) from None
    program, findings = check_text(text, str(path), registry)
    if program is None:
        raise ProgramError(findings)
    return program


def _initial(source: Source, names: list[str], report: Report, partial: bool) -> str | None:
    """Check INTERFACE, INITIAL and that there are nodes; the initial node's name if it exists."""
    top = Span(1, 1, 0)
    if not source.interfaces and not source.damaged:
        message = "the program does not say which robot interface it is for"
        report.error("missing-interface", message, top, "add INTERFACE = ...;")
    if not source.blocks and not source.damaged and not partial:
        message = "the program has no node"
        report.error("no-nodes", message, report.end, "add BEGIN ... END")
    initial = only(source.initials, "INITIAL", report)
    if initial is None:
        if not source.damaged:
            message = "the program does not say which node runs first"
            help = f"add INITIAL = {names[0] if names else '...'};"
            report.error("missing-initial", message, top, help)
        return None
    if initial.text in names:
        return initial.text
    if not _nameless(source) and not partial:
        message = f"there is no node '{initial.text}' to start with"
        report.error("unknown-initial", message, initial.span, hint(initial.text, names))
    return None


def _abort(source: Source, names: list[str], report: Report, partial: bool) -> str | None:
    """Check ABORT; the node an abort leads to if it exists."""
    abort = only(source.aborts, "ABORT", report)
    if abort is None:
        return END.name
    if abort.text in names or abort.text == END.name:
        return abort.text
    if not _nameless(source) and not partial:
        message = f"there is no node '{abort.text}' to go to when the program is aborted"
        help = hint(abort.text, [*names, END.name])
        report.error("unknown-abort", message, abort.span, help)
    return None


def _nameless(source: Source) -> bool:
    """Whether a node's NAME could not be read: it may be any that is missed."""
    return any(block.damaged and not block.names for block in source.blocks)


def _digest(texts: list[str]) -> str:
    """Of a single text its own, so that ``sha256sum`` gives the same."""
    digests = [hashlib.sha256(t.encode("utf-8", "surrogatepass")) for t in texts]
    if len(digests) == 1:
        return digests[0].hexdigest()
    return hashlib.sha256(b"".join(d.digest() for d in digests)).hexdigest()
