"""Units and node types: what may be declared."""

import math
import random

import pytest

from arm.hds import Event, NodeType, Parameter, Quantity, UnitError, registry, unit
from arm.hds.units import SYMBOLS, dimension_name, units_of


@pytest.mark.parametrize(
    ("expression", "si"),
    [
        ("1", 1.0),
        ("mm", 1e-3),
        ("cm/s", 1e-2),
        ("deg", math.pi / 180),
        ("rad/s", 1.0),
        ("cN", 1e-2),
        ("ms", 1e-3),
        ("m/s/N", 1.0),
        ("m/N/ms", 1e3),
        ("m/s^2", 1.0),
        ("mm s^-2", 1e-3),
        ("N/mm", 1e3),
        ("N m", 1.0),
        ("N*cm", 1e-2),
        ("kg m^2", 1.0),
        ("Hz", 1.0),
    ],
)
def test_unit_factors(expression: str, si: float) -> None:
    """One of each unit is this much in SI."""
    assert unit(expression).to_si("1") == si


def test_si_values_are_the_nearest_doubles() -> None:
    """A decimal number of millimetres is the very double the decimal metres are."""
    rng = random.Random(7)
    for _ in range(2000):
        number = rng.randrange(1, 10**6)
        assert unit("mm").to_si(str(number)) == float(f"{number}e-3")
        assert unit("mm").from_si(unit("mm").to_si(str(number))) == pytest.approx(number)


@pytest.mark.parametrize(
    ("one", "other"), [("rad/s", "Hz"), ("N", "N m"), ("m/s", "m/s^2"), ("deg", "1"), ("kg", "N")]
)
def test_dimensions_are_told_apart(one: str, other: str) -> None:
    """Units people mix up have different dimensions."""
    assert unit(one).dimension != unit(other).dimension


@pytest.mark.parametrize(
    "expression", ["", "/s", "m//s", "m/", "Newton", "m^99", "m^1.5", "m^", "m s2"]
)
def test_bad_units_are_refused(expression: str) -> None:
    """What is not a unit is a UnitError, never a guess."""
    with pytest.raises(UnitError):
        unit(expression)


@pytest.mark.parametrize("number", ["1e999999999", "-1e400", "1e308"])
def test_overflow_is_infinite(number: str) -> None:
    """A number too great for a double becomes infinite, in no time."""
    assert math.isinf(unit("kN/mm").to_si(number))


def test_tiny_numbers_take_no_time() -> None:
    """A huge negative exponent is zero, not a huge fraction."""
    assert unit("mm").to_si("1e-999999999") == 0.0


def test_every_suggested_unit_exists() -> None:
    """Messages only ever suggest units of the dimension they name."""
    for symbol in SYMBOLS.values():
        suggested = units_of(symbol.dimension)
        assert suggested, symbol.name
        assert all(unit(name).dimension == symbol.dimension for name in suggested)
    assert dimension_name(unit("m^3").dimension) == "quantity in m^3"
    assert units_of(unit("m^3").dimension) == ()


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: Parameter("X", "Newton"), "unknown unit"),
        (lambda: Parameter("BEGIN"), "cannot be written"),
        (lambda: Parameter("two words"), "cannot be written"),
        (lambda: Parameter("X", lo=2, hi=1), "above"),
        (lambda: Parameter("X", lo=0, hi=1, default=2.0), "default"),
        (lambda: Parameter("X", default="word"), "default"),
        (lambda: Parameter("X", default=math.nan), "default"),
        (lambda: Parameter("X", kind="integer", default=1.5), "default"),
        (lambda: Parameter("X", kind="word", choices=("A",), default="B"), "default"),
        (lambda: Parameter("X", choices=("A",)), "choices"),
        (lambda: Event("a b"), "cannot be written"),
        (lambda: NodeType("T", (Parameter("X"), Parameter("X"))), "twice"),
        (lambda: NodeType("T", (), (Event("E"), Event("E"))), "twice"),
        (lambda: NodeType("T", (), (Event("E", needs="X"),)), "needs 'X'"),
        (lambda: registry(NodeType("T"), NodeType("T")), "two node types"),
        (lambda: registry(NodeType("End")), "two node types"),
        (lambda: Event("Abort"), "accepted in every node"),
        (lambda: Quantity("LIKE"), "cannot be written"),
        (lambda: Quantity("X", "Newton"), "unknown unit"),
        (lambda: NodeType("T", quantities=(Quantity("Time", "s"),)), "quantity 'Time' twice"),
        (lambda: registry(NodeType("T"), quantities=(Quantity("X"), Quantity("X"))), "twice"),
    ],
)
def test_contradictory_declarations_are_refused(make, match: str) -> None:
    """A node type that no program could use rightly fails where it is declared."""
    with pytest.raises(ValueError, match=match):
        make()


def test_make_is_the_callers() -> None:
    """The factory is carried along and never called by the language."""
    node_type = NodeType("T", make=lambda values: dict(values))
    assert node_type.make is not None
    assert node_type.make({"X": 1.0}) == {"X": 1.0}
