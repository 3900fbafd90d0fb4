"""Named constants: declared once, put in wherever a plain word names one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from arm.hds import program, syntax
from arm.hds.finding import Report
from arm.hds.syntax import Name, Number, Value, Word
from arm.hds.units import UnitError, unit


class Constants:
    """The constants of a program.

    Args:
        declared: as written, in the order of the source, included files first.
        report: where findings about the declarations go.
        partial: an included file could not be read, so that there may be more of them.
    """

    def __init__(
        self, declared: list[syntax.Constant], report: Report, partial: bool = False
    ) -> None:
        self.partial = partial
        self._report = report
        self._values: dict[str, syntax.Constant] = {}
        self._broken: set[str] = set()
        self._used: set[str] = set()
        for constant in declared:
            name = constant.name
            if name.text in self._values:
                first = self._values[name.text].name.span
                where = "" if first.file == name.span.file else f" of {report.name(first)}"
                message = (
                    f"a constant '{name.text}' is already declared on line {first.line}{where}"
                )
                report.error("duplicate-constant", message, name.span)
            else:
                self._values[name.text] = constant
        for constant in self._values.values():
            if not self._sound(constant):
                self._broken.add(constant.name.text)

    @property
    def names(self) -> list[str]:
        """The names there are."""
        return list(self._values)

    @property
    def table(self) -> Mapping[str, program.Constant]:
        """The constants as a checked program lists them."""
        made = {}
        for name, constant in self._values.items():
            place, text = constant.name.span, _text(constant.value)
            file = self._report.name(place)
            made[name] = program.Constant(name, text, file, place.line, place.column)
        return made

    def resolve(self, value: Value) -> Value | None:
        """What a value stands for: itself, or the constant a plain word names, in the word's place.

        None for a constant whose own declaration is wrong; that has been reported.
        """
        if not isinstance(value, Word) or value.quoted or value.text not in self._values:
            return value
        self._used.add(value.text)
        if value.text in self._broken:
            return None
        meant = self._values[value.text].value
        if isinstance(meant, Word):
            return replace(meant, span=value.span)
        there = None if meant.unit is None else Name(meant.unit.text, value.span)
        return Number(meant.text, there, value.span, value.text)

    def origin(self, value: Value) -> syntax.Span:
        """Where what a value stands for is written: there, or where the constant it names is."""
        if isinstance(value, Word) and not value.quoted and value.text in self._values:
            return self._values[value.text].value.span
        return value.span

    def report_unused(self) -> None:
        """Warn of constants nothing uses; a file that is included may offer more than is used."""
        for name, constant in self._values.items():
            if name not in self._used and not constant.name.span.file:
                message = f"nothing uses the constant '{name}'"
                self._report.warning("unused-constant", message, constant.name.span)

    def _sound(self, constant: syntax.Constant) -> bool:
        value = constant.value
        if isinstance(value, Word):
            if value.quoted or value.text not in self._values:
                return True
            message = f"'{value.text}' is a constant; one constant cannot stand for another"
            self._report.error("nested-constant", message, value.span, "write the value itself")
            self._used.add(value.text)
            return False
        try:
            factor = unit(value.unit.text) if value.unit else unit("1")
        except UnitError as error:
            assert value.unit is not None
            self._report.error("unknown-unit", str(error), value.unit.span)
            return False
        if not math.isfinite(factor.to_si(value.text)):
            message = f"'{constant.name.text}' = {_text(value)} is out of range"
            self._report.error("out-of-range", message, value.span, "it must be finite")
            return False
        return True


def _text(value: Value) -> str:
    if isinstance(value, Number):
        return f"{value.text} {value.unit.text}" if value.unit else value.text
    return f'"{value.text}"' if value.quoted else value.text
