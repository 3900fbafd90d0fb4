"""What a check found, where, and how it is shown."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from arm.hds.syntax import Span

Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class Finding:
    """One finding; plain data, so ``dataclasses.asdict`` makes it JSON.

    Attributes:
        severity: ``error`` (the program is refused) or ``warning``.
        code: short stable name of the check (docs/language.md lists them).
        message: what is wrong, in one sentence.
        file: name of the source as given to the checker.
        line: line of the place, from 1; 0 for the file as a whole.
        column: column of the place in characters, from 1.
        length: characters the place covers; 0 for a place between characters.
        help: what to write instead; may be empty.
        source: the source line, for the rendering.
    """

    severity: Severity
    code: str
    message: str
    file: str
    line: int
    column: int
    length: int
    help: str = ""
    source: str = ""

    def render(self) -> str:
        """``file:line:col: error[code]: message``, the source line, a caret underline, help."""
        if not self.line:
            return f"{self.file}: {self.severity}[{self.code}]: {self.message}"
        margin = f"{self.line:>5} | "
        blank = " " * 5 + " | "
        # tabs stay tabs under tabs, so the caret stands right whatever their width
        padding = "".join("\t" if c == "\t" else " " for c in self.source[: self.column - 1])
        padding = padding.ljust(self.column - 1)
        lines = [
            f"{self.file}:{self.line}:{self.column}: {self.severity}[{self.code}]: {self.message}",
            (margin + self.source).rstrip(),
            blank + padding + "^" * max(1, self.length),
        ]
        if self.help:
            lines.append(f"      = help: {self.help}")
        return "\n".join(lines)


MOST = 40
"""Findings shown at most: a text that is no program has one in every word."""


def render(findings: Iterable[Finding]) -> str:
    """The findings one after another, ``MOST`` of them, and a last line with the number of all."""
    findings = list(findings)
    errors = sum(f.severity == "error" for f in findings)
    warnings = len(findings) - errors
    total = f"{_count(errors, 'error')}, {_count(warnings, 'warning')}"
    if len(findings) > MOST:
        total += f"; shown are the first {MOST}"
    return "\n".join([*(f.render() for f in findings[:MOST]), total])


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


class Report:
    """Collects the findings about a program: its own text, and the texts it includes."""

    def __init__(self, text: str, file: str) -> None:
        self.file = file
        self._texts = {"": text.split("\n")}
        self._findings: list[Finding] = []

    def include(self, text: str, file: str) -> None:
        """Make the text of an included file known, before anything is reported about it."""
        self._texts[file] = text.split("\n")

    def name(self, place: Span) -> str:
        """The file of a place as findings name it."""
        return place.file or self.file

    def error(self, code: str, message: str, place: Span, help: str = "") -> None:
        """Add an error at ``place``."""
        self._add("error", code, message, place, help)

    def warning(self, code: str, message: str, place: Span, help: str = "") -> None:
        """Add a warning at ``place``."""
        self._add("warning", code, message, place, help)

    @property
    def findings(self) -> list[Finding]:
        """The findings so far, in the order of their places; included files come behind."""
        order = {file or self.file: i for i, file in reversed(list(enumerate(self._texts)))}
        return sorted(
            self._findings,
            key=lambda f: (order[f.file], f.line, f.column, f.code, f.message),
        )

    @property
    def has_errors(self) -> bool:
        """Whether the program has to be refused."""
        return any(f.severity == "error" for f in self._findings)

    @property
    def end(self) -> Span:
        """The place just behind the last character of the program that is not blank."""
        lines = self._texts[""]
        for number in range(len(lines), 0, -1):
            line = lines[number - 1].rstrip()
            if line:
                return Span(number, len(line) + 1, 0)
        return Span(1, 1, 0)

    def _add(self, severity: Severity, code: str, message: str, place: Span, help: str) -> None:
        source = self._texts[place.file][place.line - 1].rstrip("\r")
        length = min(place.length, max(0, len(source) - place.column + 1))
        self._findings.append(
            Finding(
                severity,
                code,
                message,
                self.name(place),
                place.line,
                place.column,
                length,
                help,
                source,
            )
        )
