"""A written value against the parameter it is for: kind, unit, range; the result is SI."""

from __future__ import annotations

import math
from dataclasses import replace

from arm.hds.constants import Constants
from arm.hds.finding import Report
from arm.hds.names import hint, listing
from arm.hds.nodetype import Parameter, ParameterValue
from arm.hds.syntax import Number, Value, Word
from arm.hds.units import Unit, UnitError, dimension_name, unit, units_of


def check_value(
    parameter: Parameter, value: Value, constants: Constants, report: Report
) -> ParameterValue | None:
    """The value in SI; None if the parameter does not take it, which has then been reported."""
    meant = constants.resolve(value)
    if meant is None:
        return None
    if parameter.kind == "word":
        return _word(parameter, meant, report)
    if isinstance(meant, Word):
        _no_number(parameter, meant, constants, report)
        return None
    value = meant
    written = parameter.default_unit
    if value.unit is not None:
        found = _unit(parameter, value, report)
        if found is None:
            return None
        written = found
    si = written.to_si(value.text)
    if parameter.kind == "integer" and math.isfinite(si) and not si.is_integer():
        message = f"'{parameter.name}' is an integer, not {value.text}" + _via(value)
        report.error("not-an-integer", message, value.span)
        return None
    if not math.isfinite(si) or not parameter.lo <= si <= parameter.hi:
        _out_of_range(parameter, value, written, report)
        return None
    return int(si) if parameter.kind == "integer" else si


def _no_number(parameter: Parameter, value: Word, constants: Constants, report: Report) -> None:
    wanted = "an integer" if parameter.kind == "integer" else "a number"
    if value.quoted:
        message = f"'{parameter.name}' is {wanted}, not the word '{value.text}'"
        report.error("wrong-kind", message, value.span)
    elif not constants.partial:
        message = f"'{parameter.name}' is {wanted}, and no constant is called '{value.text}'"
        help = (
            hint(value.text, constants.names, "constants")
            if constants.names
            else f"write a number, or declare CONSTANT {value.text} = ...; in the header"
        )
        report.error("unknown-constant", message, value.span, help)


def _word(parameter: Parameter, value: Value, report: Report) -> str | None:
    if isinstance(value, Number):
        message = f"'{parameter.name}' is a word, not the number {value.text}" + _via(value)
        help = listing(parameter.choices, "valid words") if parameter.choices else ""
        report.error("wrong-kind", message, value.span, help)
        return None
    if parameter.choices and value.text not in parameter.choices:
        message = f"'{parameter.name}' cannot be '{value.text}'"
        help = hint(value.text, parameter.choices, "valid words")
        report.error("unknown-choice", message, value.span, help)
        return None
    return value.text


def _unit(parameter: Parameter, value: Number, report: Report) -> Unit | None:
    assert value.unit is not None
    wanted = parameter.default_unit
    quantity = dimension_name(wanted.dimension)
    valid = units_of(wanted.dimension) or (wanted.name,)
    label = f"units of {quantity}"
    try:
        found = unit(value.unit.text)
    except UnitError as error:
        report.error(
            "unknown-unit", str(error), value.unit.span, hint(value.unit.text, valid, label)
        )
        return None
    if found.dimension != wanted.dimension:
        other = dimension_name(found.dimension)
        message = f"'{parameter.name}' is a {quantity}, but '{found.name}' is a unit of {other}"
        message += _via(value)
        report.error("wrong-dimension", message, value.unit.span, listing(valid, label))
        return None
    return found


def _out_of_range(parameter: Parameter, value: Number, written: Unit, report: Report) -> None:
    suffix = "" if written.name == "1" else f" {written.name}"
    lo, hi = (f"{written.from_si(limit):.6g}{suffix}" for limit in (parameter.lo, parameter.hi))
    if math.isinf(parameter.lo) and math.isinf(parameter.hi):
        limits = "it must be finite"
    elif math.isinf(parameter.hi):
        limits = f"the least is {lo}"
    elif math.isinf(parameter.lo):
        limits = f"the greatest is {hi}"
    else:
        limits = f"it must be from {lo} to {hi}"
    bare = "" if value.unit is not None or not suffix else f"; a bare number is in{suffix}"
    message = f"'{parameter.name}' = {value.text}{suffix} is out of range" + _via(value)
    place = value.span
    if value.unit is not None and value.unit.span.line == place.line:
        behind = value.unit.span.column + value.unit.span.length
        place = replace(place, length=behind - place.column)
    report.error("out-of-range", message, place, limits + bare)


def _via(value: Number) -> str:
    """Where a number came from that is not written where it is used."""
    if not value.constant:
        return ""
    unit = f" {value.unit.text}" if value.unit else ""
    return f" (constant '{value.constant}' is {value.text}{unit})"
