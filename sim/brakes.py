"""Brakes of a robot's motors: they hold its joints while no torque command is young enough."""

from __future__ import annotations

from collections.abc import Callable

from services.messages import Message

AFTER = 0.04
"""The motors brake when the newest torque command is older than this [s]: 50 ms after a loss the
joints are at rest."""
HOLDING = 300.0
"""Coulomb friction of an engaged brake [N m]."""


class Brakes:
    """Brakes that are engaged at first.

    Args:
        hold: adds so much Coulomb friction [N m] to what the joints have of their own.

    Attributes:
        on: whether they are engaged.
    """

    def __init__(self, hold: Callable[[float], None]) -> None:
        self._hold = hold
        self.on = True
        hold(HOLDING)

    def look(self, now: float, *commands: Message | None) -> bool:
        """Engage or release them at robot time ``now`` [s]; returns whether they are engaged.

        Args:
            now: robot time [s].
            commands: the newest of every kind that the motors need, None before the first.
        """
        silent = any(command is None or now - command.t > AFTER for command in commands)
        if silent != self.on:
            self.on = silent
            self._hold(HOLDING if silent else 0.0)
        return silent
