"""Statements to nodes: which statement belongs to which BEGIN ... END."""

from __future__ import annotations

from arm.hds import syntax
from arm.hds.finding import Report
from arm.hds.names import nearest
from arm.hds.syntax import Block, Name, Source, Span

_HEADER = ("INTERFACE", "INITIAL", "ABORT")


class Structure:
    """Takes the statements one by one and reports those that stand in the wrong place.

    Args:
        report: where findings go.
        included: the text is an included one, which has nodes and constants only.
    """

    def __init__(self, report: Report, included: bool = False) -> None:
        self._report = report
        self._included = included
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
                self._once("INTERFACE", place, self._source.interfaces, name)
            case syntax.Initial(name):
                self._once("INITIAL", place, self._source.initials, name)
            case syntax.Abort(name):
                self._once("ABORT", place, self._source.aborts, name)
            case syntax.Constant():
                self._placed("CONSTANT", place)
                self._source.constants.append(statement)
            case syntax.Include(path):
                self._placed("INCLUDE", place)
                self._source.includes.append(path)
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

    def _once(self, keyword: str, place: Span, names: list[Name], name: Name) -> None:
        """A statement of the header that a program makes once."""
        if self._included:
            self._report.error(
                "misplaced-statement",
                f"{keyword} stands in an included file",
                place,
                "an included file has constants, nodes and INCLUDE only",
            )
        elif self._placed(keyword, place) or not names:  # misplaced and twice is one finding
            names.append(name)

    def _placed(self, keyword: str, place: Span) -> bool:
        """Whether a header's statement stands in the header."""
        if self._block is None and not self._source.blocks:
            return True
        where = "inside a node" if self._block is not None else "behind a node"
        self._report.error(
            "misplaced-statement",
            f"{keyword} stands {where}",
            place,
            f"{keyword} belongs before the first BEGIN",
        )
        return False

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
            case syntax.Like(name):
                block.likes.append(name)
            case syntax.Assignment():
                block.parameters.append(statement)
            case syntax.Transition():
                block.transitions.append(statement)
            case syntax.Guarded():
                block.guards.append(statement)
