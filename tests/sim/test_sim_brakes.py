"""Brakes of the simulated motors."""

from __future__ import annotations

import numpy as np

from services.messages import ArmCommand, HandCommand
from sim.brakes import AFTER, HOLDING, Brakes


def test_motors_turn_only_while_every_command_is_young() -> None:
    """Engaged at first; one command that is missing or too old is enough to engage them again."""
    held: list[float] = []
    brakes = Brakes(held.append)
    arm, hand = ArmCommand(t=1.0, tau=np.zeros(7)), HandCommand(t=1.02, tau=np.zeros(4))
    assert brakes.on and brakes.look(1.02, arm, None)
    assert not brakes.look(1.0 + AFTER - 1e-3, arm, hand)
    assert brakes.look(1.0 + AFTER + 1e-3, arm, hand)
    assert held == [HOLDING, 0.0, HOLDING]
