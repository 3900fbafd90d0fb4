"""The check before anything moves: a program comes out without an error, or not at all."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from arm.hds.finding import Finding, Report, render
from arm.hds.flow import check_flow
from arm.hds.names import hint
from arm.hds.nodetype import Registry
from arm.hds.parser import parse
from arm.hds.program import END, Program
from arm.hds.semantics import NodeCheck, check_node, node_names, only
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
        filename: what findings call it.
        registry: node types by name.

    Returns:
        The program, or None if there is any error; and all findings, in order of place.
    """
    digest = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
    text = text.removeprefix("\ufeff")
    report = Report(text, filename)
    source = parse(text, report)
    interface = only(source.interfaces, "INTERFACE", report)
    blocks = node_names(source, report)
    initial = _header(source, list(blocks), report)

    # a node with somebody else's name or none is checked too, but nothing leads to it
    placed = {id(block): name for name, block in blocks.items()}
    targets = dict.fromkeys([*blocks, END.name])  # found at once, listed in order
    checked: dict[str, NodeCheck] = {}
    for block in source.blocks:
        check = check_node(block, targets, registry, report)
        if id(block) in placed:
            checked[check.node.name] = check
    check_flow(checked, blocks, initial, registry, report)

    findings = report.findings
    if report.has_errors or interface is None or initial is None:
        return None, findings
    nodes = {name: check.node for name, check in checked.items()}
    return Program(nodes, initial, interface.text, filename, digest, tuple(findings)), findings


def load(path: str | Path, registry: Registry) -> Program:
    """Read and check a program file.

    Raises:
        ProgramError: the program has an error; all findings are in it.
        OSError: the file cannot be read.
    """
    raw = Path(path).read_bytes()
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError as error:
        report = Report(raw.decode("utf-8", "replace"), str(path))
        before = raw[: error.start].decode("utf-8", "replace")
        place = Span(before.count("\n") + 1, len(before) - before.rfind("\n"), 1)
        message = f"byte 0x{raw[error.start]:02x} is not UTF-8"
        report.error("encoding", message, place, "save the file as UTF-8")
        raise ProgramError(report.findings) from None
    program, findings = check_text(text, str(path), registry)
    if program is None:
        raise ProgramError(findings)
    return program


def _header(source: Source, names: list[str], report: Report) -> str | None:
    """Check INTERFACE, INITIAL and that there are nodes; the initial node's name if it exists."""
    top = Span(1, 1, 0)
    if not source.interfaces and not source.damaged:
        message = "the program does not say which robot interface it is for"
        report.error("missing-interface", message, top, "add INTERFACE = ...;")
    if not source.blocks and not source.damaged:
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
    # a node whose NAME could not be read may be the one that is meant
    if not any(block.damaged and not block.names for block in source.blocks):
        message = f"there is no node '{initial.text}' to start with"
        report.error("unknown-initial", message, initial.span, hint(initial.text, names))
    return None
