"""Units a program may write: each is a dimension and a factor to SI.

A unit is an expression over a table of symbols: ``mm/s``, ``m/N/ms``, ``m/s^2``, ``N m``. Every
``/`` divides by the one symbol after it, as in ``m/N/ms`` = m/(N ms). Factors are exact fractions,
so ``1200 mm`` is the very double ``1.2`` and not its neighbour beyond a limit of 1.2.

Angle is a dimension of its own here: otherwise rad/s and Hz would be the same and a program could
write one for the other.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

Dimension = tuple[tuple[str, int], ...]
"""Base units and their exponents, sorted, without zeros: speed is (("m", 1), ("s", -1))."""


class UnitError(ValueError):
    """A unit that is not in the table; ``symbol`` is the part nobody knows."""

    def __init__(self, message: str, symbol: str) -> None:
        super().__init__(message)
        self.symbol = symbol


@dataclass(frozen=True)
class Unit:
    """A unit as written: SI value = written value times ``factor``."""

    name: str
    dimension: Dimension
    factor: Fraction

    def to_si(self, number: str) -> float:
        """The double nearest to ``number`` (as written) in SI; infinite if it overflows."""
        written = float(number)
        if written == 0 or math.isinf(written):
            return written  # also keeps 1e-999999999 from becoming a huge fraction
        try:
            return float(Fraction(number) * self.factor)
        except OverflowError:
            return math.copysign(math.inf, written)

    def from_si(self, value: float) -> float:
        """An SI value in this unit."""
        return float(Fraction(value) / self.factor) if math.isfinite(value) else value


def _dimension(**exponents: int) -> Dimension:
    return tuple(sorted((base, power) for base, power in exponents.items() if power))


_LENGTH, _TIME, _MASS, _ANGLE = (_dimension(**{base: 1}) for base in ("m", "s", "kg", "rad"))
_FORCE = _dimension(kg=1, m=1, s=-2)

_MILLI, _CENTI, _MICRO = Fraction(1, 1000), Fraction(1, 100), Fraction(1, 10**6)

_TABLE: list[tuple[str, Dimension, int | Fraction]] = [
    ("1", (), 1),
    ("m", _LENGTH, 1),
    ("cm", _LENGTH, _CENTI),
    ("mm", _LENGTH, _MILLI),
    ("um", _LENGTH, _MICRO),
    ("s", _TIME, 1),
    ("ms", _TIME, _MILLI),
    ("us", _TIME, _MICRO),
    ("min", _TIME, 60),
    ("kg", _MASS, 1),
    ("g", _MASS, _MILLI),
    ("rad", _ANGLE, 1),
    ("mrad", _ANGLE, _MILLI),
    ("deg", _ANGLE, Fraction(math.pi) / 180),
    ("N", _FORCE, 1),
    ("kN", _FORCE, 1000),
    ("cN", _FORCE, _CENTI),
    ("mN", _FORCE, _MILLI),
    ("Nm", _dimension(kg=1, m=2, s=-2), 1),
    ("W", _dimension(kg=1, m=2, s=-3), 1),
    ("Hz", _dimension(s=-1), 1),
    ("kHz", _dimension(s=-1), 1000),
]

SYMBOLS = {name: Unit(name, dimension, Fraction(factor)) for name, dimension, factor in _TABLE}
"""The symbols expressions are made of. A new unit is one line in the table."""

_COMMON: dict[str, tuple[str, ...]] = {
    "pure number": ("1",),
    "length": ("m", "cm", "mm", "um"),
    "time": ("s", "ms", "us", "min"),
    "mass": ("kg", "g"),
    "angle": ("rad", "deg", "mrad"),
    "force": ("N", "cN", "mN", "kN"),
    "torque": ("N m", "Nm"),
    "power": ("W",),
    "frequency": ("Hz", "kHz"),
    "speed": ("m/s", "cm/s", "mm/s"),
    "acceleration": ("m/s^2", "mm/s^2"),
    "jerk": ("m/s^3", "mm/s^3"),
    "angular speed": ("rad/s", "deg/s"),
    "angular acceleration": ("rad/s^2", "deg/s^2"),
    "force rate": ("N/s", "cN/s"),
    "stiffness": ("N/m", "N/mm"),
    "angular stiffness": ("N m/rad", "N m/deg"),
    "damping": ("N s/m",),
    "angular damping": ("N m s/rad",),
    "compliance": ("m/N", "mm/N"),
    "admittance": ("m/s/N", "mm/s/N", "m/N/ms"),
    "pressure": ("N/m^2", "N/mm^2"),
    "area": ("m^2", "mm^2"),
    "inertia": ("kg m^2",),
}
"""Name of a dimension and the units people write for it, for messages."""

_PART = re.compile(r"\s*([*/]?)\s*([A-Za-z_][A-Za-z0-9_]*|1)\s*(?:\^\s*([+-]?[0-9]+))?\s*")


def spell(expression: str) -> str:
    """The one spelling of a unit expression: ``N * m``, ``N  m`` and ``N m`` are ``N m``."""
    tight = re.sub(r"\s*([/^])\s*", r"\1", expression.strip())
    return re.sub(r"\s*\*\s*|\s+", " ", tight)


@cache
def unit(expression: str) -> Unit:
    """The unit an expression stands for.

    Raises:
        UnitError: a symbol is not in ``SYMBOLS``, an exponent is beyond 9, or it is no expression.
    """
    name = spell(expression)
    powers: dict[str, int] = {}
    factor = Fraction(1)
    place = 0
    while place < len(name) or place == 0:
        part = _PART.match(name, place)
        if part is None or (place == 0 and part[1]):
            raise UnitError(f"'{name}' is not a unit", name)
        symbol = SYMBOLS.get(part[2])
        if symbol is None:
            raise UnitError(f"unknown unit '{part[2]}'", part[2])
        power = int(part[3]) if part[3] and len(part[3]) < 4 else (99 if part[3] else 1)
        if abs(power) > 9:
            raise UnitError(f"exponent of '{part[2]}' is beyond 9", name)
        power = -power if part[1] == "/" else power
        factor *= symbol.factor**power
        for base, exponent in symbol.dimension:
            powers[base] = powers.get(base, 0) + exponent * power
        place = part.end()
    return Unit(name, _dimension(**powers), factor)


@cache
def _names() -> dict[Dimension, str]:
    return {unit(units[0]).dimension: name for name, units in _COMMON.items()}


def dimension_name(dimension: Dimension) -> str:
    """What people call a dimension: ``force``; without a name, its base units: ``m^3``."""
    written = " ".join(b if p == 1 else f"{b}^{p}" for b, p in dimension)
    return _names().get(dimension, f"quantity in {written}")


def units_of(dimension: Dimension) -> tuple[str, ...]:
    """Units people write for a dimension, the SI one first; empty for one without a name."""
    return _COMMON.get(_names().get(dimension, ""), ())
