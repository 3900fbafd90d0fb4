"""One parsed statement to its piece of the syntax tree."""

from __future__ import annotations

from lark import Token, Tree

from arm.hds import syntax
from arm.hds.syntax import Name, Number, Span, Word


class Build:
    """Makes the syntax tree of statements of one file.

    Args:
        file: what places in it are marked with (``Span.file``).
    """

    def __init__(self, file: str) -> None:
        self.file = file

    def statement(self, tree: Tree[Token]) -> syntax.Statement:
        """The syntax tree of one statement from lark's."""
        parts = tree.children
        match tree.data:
            case "interface":
                return syntax.Interface(self._name(parts[2]))
            case "initial":
                return syntax.Initial(self._name(parts[2]))
            case "abort":
                return syntax.Abort(self._name(parts[2]))
            case "constant":
                return syntax.Constant(self._name(parts[1]), self._value(parts[3]))
            case "include":
                return syntax.Include(self._name(parts[1]))
            case "begin":
                return syntax.Begin(self._name(parts[0]).span)
            case "end":
                return syntax.End(self._name(parts[0]).span)
            case "name":
                return syntax.NodeName(self._name(parts[2]))
            case "type":
                return syntax.TypeName(self._name(parts[2]))
            case "like":
                return syntax.Like(self._name(parts[2]))
            case "parameter":
                return syntax.Assignment(self._name(parts[0]), self._value(parts[2]))
            case "transition":
                return syntax.Transition(self._name(parts[2]), self._name(parts[5]))
            case "guarded":
                return syntax.Guarded(
                    self._name(parts[2]), str(parts[3]), self._value(parts[4]), self._name(parts[7])
                )
        raise AssertionError(f"grammar.lark has a statement nobody builds: {tree.data}")

    def span(self, token: Token) -> Span:
        """The place of a token."""
        return Span(token.line or 1, token.column or 1, len(token), self.file)

    def behind(self, token: Token) -> Span:
        """The place just behind a token."""
        return Span(token.line or 1, (token.column or 1) + len(token), 0, self.file)

    def _value(self, tree: Token | Tree[Token]) -> syntax.Value:
        assert isinstance(tree, Tree)
        written = tree.children[0]
        first = self._name(written)
        if tree.data == "word":
            return Word(first.text, first.span, isinstance(written, Token) and '"' in written)
        return Number(first.text, self._unit(tree.children[1:]), first.span)

    def _unit(self, trees: list[Token | Tree[Token]]) -> Name | None:
        """A unit as written, with one blank where there were any."""
        if not trees:
            return None
        assert isinstance(trees[0], Tree)
        pieces = [p for p in trees[0].children if isinstance(p, Token)]
        joined = "".join(
            f" {p}" if i and p.type == "WORD" and pieces[i - 1].type in ("WORD", "NUMBER") else p
            for i, p in enumerate(pieces)
        )
        start, end = self.span(pieces[0]), pieces[-1]
        if end.line == start.line and end.end_column:
            start = Span(start.line, start.column, end.end_column - start.column, self.file)
        return Name(joined, start)

    def _name(self, token: Token | Tree[Token]) -> Name:
        assert isinstance(token, Token)
        text = str(token).strip('"') if token.type == "STRING" else str(token)
        return Name(text, self.span(token))
