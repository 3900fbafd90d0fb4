"""Statements to nodes: which statement belongs to which BEGIN ... END."""

from __future__ import annotations

from arm.hds import syntax
from arm.hds.finding import Report
from arm.hds.names import nearest
from arm.hds.syntax import Block, Name, Source, Span

_HEADER = ("INTERFACE", "INITIAL")


class Structure:
    """Takes the statements one by one and reports those that stand in the wrong place."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._source = Source()
        self._block: Block | None = None
        self._implicit = False  # the open block has no BEGIN, which has been reported

    def unreadable(self) -> None:
        """A statement that could not be read, so something is missing here."""
        (self._block or self._source).damaged = True

    def add(self, statement: syntax.Statement, place: Span) -> None:
        """Put a statement that starts at ``place`` where it belongs."""
        match statement:
            case syntax.Interface(name):
                self._header("INTERFACE", place, self._source.interfaces, name)
            case syntax.Initial(name):
                self._header("INITIAL", place, self._source.initials, name)
            case syntax.Begin(span):
                self._unclosed()
                self._open(span)
            case syntax.End(span):
                if self._block is None:
                    self._report.error("stray-end", "END without a BEGIN", span)
                self._block = None
            case _:
                self._body(statement, place)

    def finish(self) -> Source:
        """The whole source, after its last statement."""
        self._unclosed()
        return self._source

    def _header(self, keyword: str, place: Span, names: list[Name], name: Name) -> None:
        misplaced = self._block is not None or bool(self._source.blocks)
        if misplaced:
            where = "inside a node" if self._block is not None else "behind a node"
            self._report.error(
                "misplaced-statement",
                f"{keyword} stands {where}",
                place,
                f"{keyword} belongs before the first BEGIN",
            )
        if not misplaced or not names:  # in the wrong place and twice is one finding
            names.append(name)

    def _open(self, span: Span, implicit: bool = False) -> Block:
        self._block = Block(span, damaged=implicit)
        self._implicit = implicit
        self._source.blocks.append(self._block)
        return self._block

    def _unclosed(self) -> None:
        if self._block is not None and not self._implicit:
            # its END may be missing anywhere, so what it holds may belong to another node
            self._block.damaged = True
            self._report.error(
                "missing-end", "this BEGIN has no END", self._block.span, "a node ends with END"
            )
        self._block = None

    def _body(self, statement: syntax.Statement, place: Span) -> None:
        block = self._block
        if block is None:
            if isinstance(statement, syntax.Assignment) and not self._source.blocks:
                keyword = nearest(statement.name.text, _HEADER, 0.7)
                if keyword:
                    self._report.error(
                        "misspelt-keyword",
                        f"unknown keyword '{statement.name.text}'",
                        place,
                        f"did you mean '{keyword}'?",
                    )
                    self._source.damaged = True
                    return
            self._report.error(
                "missing-begin", "this stands outside a node", place, "a node starts with BEGIN"
            )
            block = self._open(place, implicit=True)
        match statement:
            case syntax.NodeName(name):
                block.names.append(name)
            case syntax.TypeName(name):
                block.types.append(name)
            case syntax.Assignment():
                block.parameters.append(statement)
            case syntax.Transition():
                block.transitions.append(statement)
