"""What wheels see, and when they hold."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deploy.robot import load_robot
from services.messages import BaseCommand
from sim.drive import HOLDING, Drive
from sim.effects import NONE, Effects
from sim.rolling import FREE, Rolling, on_platform

INERTIA = np.array([100.0, 100.0, 10.0])
LAG = 0.1


class Wheels(Rolling):
    """Wheels on an even floor that remember what they held."""

    def __init__(self, slow: float = 0.0) -> None:
        self.held: list[tuple[float, float, float]] = []
        rng = np.random.default_rng(0)
        drive = Drive(load_robot("xr4000_puma560"), INERTIA, LAG, np.zeros(3), 0.3, rng, 0.001)
        super().__init__(drive, self.held.append, HOLDING, slow)


def told(*velocity: float) -> BaseCommand:
    """A command at t = 0."""
    return BaseCommand(t=0.0, velocity=np.array(velocity))


def test_a_slip_is_not_seen() -> None:
    """Who moves as they slip is driven like one that stands, but the wheels do not hold."""
    wheels, still = Wheels(), Wheels()
    slip = Effects(slips=True, slip=np.array([0.2, -0.1]))
    moved = wheels.force(0.0, told(0.1, 0.0, 0.0), 0.7, np.array([0.2, -0.1, 0.0]), slip)
    assert moved == still.force(0.0, told(0.1, 0.0, 0.0), 0.7, np.zeros(3), NONE)
    wheels.force(0.0, told(0.0, 0.0, 0.0), 0.7, np.array([0.2, -0.1, 0.0]), slip)
    still.force(0.0, told(0.0, 0.0, 0.0), 0.7, np.zeros(3), NONE)
    assert (wheels.held, still.held) == ([], [HOLDING])


@pytest.mark.parametrize(("slow", "held"), [(0.0, []), (0.02, [HOLDING, FREE])])
def test_slow_wheels_that_are_asked_to_stand_hold_until_they_are_asked_to_move(
    slow: float, held: list[tuple[float, float, float]]
) -> None:
    """Above the drive's own standstill only those that are said to hold below ``slow`` do."""
    wheels, creeping = Wheels(slow), np.array([0.01, 0.0, 0.0])
    wheels.force(0.0, told(0.0, 0.0, 0.0), 0.0, creeping, NONE)
    wheels.force(0.0, told(0.1, 0.0, 0.0), 0.0, creeping, NONE)
    assert wheels.held == held


def test_force_on_the_platform_is_turned_with_it_and_slips_and_bumps_add_their_own() -> None:
    """Ahead of a platform that looks along y is y of the world."""
    effects = Effects(yaw=2.0, slips=True, slip_acceleration=np.array([0.5, 0.0]))
    force = on_platform((30.0, 0.0, 1.0), math.pi / 2, effects, lambda: INERTIA)
    np.testing.assert_allclose(force, [50.0, 30.0, 21.0], atol=1e-12)
