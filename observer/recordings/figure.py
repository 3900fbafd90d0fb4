"""A number that a log may or may not tell."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """An estimate, with its standard deviation, or the reason why there is none.

    Attributes:
        value: None if it cannot be told.
        sigma: standard deviation, as far as the log shows; nan if unknown.
        reason: why it cannot be told, in plain words.
    """

    value: float | None = None
    sigma: float = math.nan
    reason: str = ""

    @property
    def told(self) -> bool:
        """Whether there is a value."""
        return self.value is not None

    def beyond(self, expected: float, least: float = 0.0, sigmas: float = 3.0) -> bool:
        """Whether the value differs from ``expected`` by more than chance and ``least``."""
        if self.value is None:
            return False
        noise = sigmas * self.sigma if math.isfinite(self.sigma) else 0.0
        return abs(self.value - expected) > max(noise, least)

    def otherwise(self, value: float) -> float:
        """The value, or another where there is none."""
        return value if self.value is None else self.value


def untold(reason: str) -> Figure:
    """A figure that cannot be told."""
    return Figure(reason=reason)
