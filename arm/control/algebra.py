"""The algebra of the control basis: "subject to" as an expression that can be read and simplified.

``moment.subject_to(force).subject_to(reach)`` reads and prints like the papers' Φm / Φf / Φreach:
reach first, force in its null space, moment in the null space of both (Platt et al., Eq 3 and 7).
Two rules hold for what is executed (their Eq 8 to 11):

- parentheses do not matter: (a / b) / c = a / (b / c);
- of an objective that occurs twice the right-most occurrence, its highest priority, is kept.

A composite remembers how it was written, so that a derivation can be shown line by line::

    comply / gm / reach
    = moment / force / reach / (force / reach) / reach
    = moment / force / reach / force / reach / reach
    = moment / force / reach
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from arm.control.objective import Objective


class Composable:
    """What single objectives and composites have in common.

    Attributes:
        name: as it is printed; of a composite empty unless it was ``called`` something.
    """

    name: str = ""

    def subject_to(self, other: Composable) -> Composite:
        """This, in the null space of ``other``."""
        return Composite(self, other)

    def __truediv__(self, other: Composable) -> Composite:
        """``a / b`` is ``a.subject_to(b)``."""
        return Composite(self, other)

    def parts(self) -> tuple[Objective, ...]:
        """The single objectives to execute, highest priority first, each once."""
        raise NotImplementedError

    def occurrences(self) -> tuple[Objective, ...]:
        """The single objectives as written, highest priority first, repetitions included."""
        return self.parts()

    def expanded(self) -> Composable:
        """The same with the definition in place of every composite's name."""
        return self

    def simplified(self) -> Composable:
        """The same without names, parentheses and repetitions."""
        return chain(self.parts())

    def __str__(self) -> str:
        return self.name or type(self).__name__.lower()


class Composite(Composable):
    """``lower / upper``: lower in the null space of upper.

    Args:
        lower: acts in the null space of upper, each an objective or a composite.
        upper: is not moved by lower.
        name: printed in its place.
    """

    def __init__(self, lower: Composable, upper: Composable, name: str = "") -> None:
        self.lower, self.upper, self.name = lower, upper, name
        self._parts: tuple[Objective, ...] | None = None

    def parts(self) -> tuple[Objective, ...]:
        """See ``Composable``; of two occurrences the right-most, first in priority, stays."""
        if self._parts is None:
            # by identity: two position objectives are two, however alike
            once = {id(objective): objective for objective in self.occurrences()}
            self._parts = tuple(once.values())
        return self._parts

    def occurrences(self) -> tuple[Objective, ...]:
        """See ``Composable``."""
        return self.upper.occurrences() + self.lower.occurrences()

    def called(self, name: str) -> Composite:
        """The same under a name of its own, as Φ_comply stands for Φm / Φf / Φreach."""
        return Composite(self.lower, self.upper, name)

    def expanded(self) -> Composable:
        """See ``Composable``."""
        return Composite(self.lower.expanded(), self.upper.expanded())

    def derivation(self) -> list[str]:
        """Eq 8 to 11 of Platt et al. for this composite; lines that change nothing are left out."""
        flat = " / ".join(str(o) for o in reversed(self.occurrences()))
        lines = [str(self), str(self.expanded()), flat, str(self.simplified())]
        return [line for i, line in enumerate(lines) if i == 0 or line != lines[i - 1]]

    def __str__(self) -> str:
        if self.name:
            return self.name
        bare = self.upper.name or not isinstance(self.upper, Composite)
        # a / b / c reads from the left: only the right operand needs parentheses
        return f"{self.lower} / {self.upper}" if bare else f"{self.lower} / ({self.upper})"


def chain(objectives: tuple[Objective, ...]) -> Composable:
    """The composite of single objectives, highest priority first, written without parentheses.

    Raises:
        ValueError: there are none.
    """
    if not objectives:
        raise ValueError("a composite of no objectives")
    out: Composable = objectives[-1]
    for objective in reversed(objectives[:-1]):
        out = Composite(out, objective)
    return out


def parallelised(sequence: list[Composable]) -> Composable:
    """The one controller that executes a refining sequence at once: Φk / ... / Φ2 / Φ1 (Eq 3).

    Args:
        sequence: in the order in which the sequence would execute them.

    Raises:
        ValueError: the sequence is empty.
    """
    if not sequence:
        raise ValueError("a sequence of no controllers")
    out = sequence[-1]
    for controller in reversed(sequence[:-1]):
        out = out.subject_to(controller)
    return out
