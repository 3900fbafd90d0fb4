"""Included files: found relative to the including one, read once, merged in front of it."""

from __future__ import annotations

import os
from pathlib import Path

from arm.hds.finding import Report
from arm.hds.names import hint
from arm.hds.parser import parse
from arm.hds.syntax import Block, Constant, Name, Source, Span


class UnreadableText(ValueError):
    """Bytes that are not UTF-8; carries what could be read and where the rest begins."""

    def __init__(self, raw: bytes, start: int) -> None:
        before = raw[:start].decode("utf-8", "replace")
        super().__init__(f"byte 0x{raw[start]:02x} is not UTF-8")
        self.text = raw.decode("utf-8", "replace")
        self.line = before.count("\n") + 1
        self.column = len(before) - before.rfind("\n")


def read_text(path: Path) -> str:
    """The text of a program file.

    Raises:
        UnreadableText: it is not UTF-8.
        OSError: it cannot be read.
    """
    raw = path.read_bytes()
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        raise UnreadableText(raw, error.start) from None


class Includes:
    """Reads what a program includes, and what that includes.

    Attributes:
        files: included files as findings name them, in the order they were read.
        texts: their texts, in the same order.
        partial: something that is included could not be read.
    """

    def __init__(self, report: Report) -> None:
        self._report = report
        self._seen: set[Path] = set()
        self.files: list[str] = []
        self.texts: list[str] = []
        self.partial = False

    def merge(self, source: Source) -> Source:
        """The source with the constants and nodes of everything it includes in front of its own."""
        main = Path(self._report.file)
        self._merge_into(source, main, [main.resolve()])
        return source

    def _merge_into(self, source: Source, file: Path, chain: list[Path]) -> None:
        """Read what ``source`` includes; ``chain`` is how it came to be read itself."""
        here: set[Path] = set()
        constants: list[Constant] = []
        blocks: list[Block] = []
        for name in source.includes:
            found = self._find(name, file.parent, chain, here)
            part = None if found is None else self._read(found, name)
            if found is None or part is None:
                continue
            self._merge_into(part, found, [*chain, found.resolve()])
            constants += part.constants
            blocks += part.blocks
            source.damaged |= part.damaged
        source.constants[:0] = constants
        source.blocks[:0] = blocks

    def _find(self, name: Name, folder: Path, chain: list[Path], here: set[Path]) -> Path | None:
        """The file to read; None, with a finding where that is wrong, if there is none to read."""
        path = Path(os.path.normpath(folder / name.text))
        try:
            regular, real = path.is_file(), path.resolve()
        except (OSError, ValueError, RuntimeError):  # a name no file can have, a loop of links
            regular, real = False, path
        if not regular:
            there = sorted(p.name for p in folder.glob("*.hds")) if folder.is_dir() else []
            help = hint(name.text, there, "programs there")
            message = f"there is no file '{path}'"
            self._report.error("missing-include", message, name.span, help)
            self.partial = True
            return None
        if real in chain:
            way = " -> ".join(p.name for p in [*chain[chain.index(real) :], real])
            message = f"'{name.text}' includes itself: {way}"
            self._report.error("include-cycle", message, name.span)
            return None
        if real in here:
            message = f"'{name.text}' is already included here"
            self._report.error("duplicate-include", message, name.span)
            return None
        here.add(real)
        if real in self._seen:  # two files may build on a third
            return None
        self._seen.add(real)
        return path

    def _read(self, path: Path, name: Name) -> Source | None:
        file = str(path)
        try:
            text = read_text(path)
        except UnreadableText as error:
            self._report.include(error.text, file)
            place = Span(error.line, error.column, 1, file)
            self._report.error("encoding", str(error), place, "save the file as UTF-8")
            self.partial = True
            return None
        except OSError as error:
            message = f"'{path}' cannot be read: {error.strerror}"
            self._report.error("missing-include", message, name.span)
            self.partial = True
            return None
        self.files.append(file)
        self.texts.append(text)
        text = text.removeprefix("\ufeff")
        self._report.include(text, file)
        return parse(text, self._report, file)
