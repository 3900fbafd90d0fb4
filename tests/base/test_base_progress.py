"""A platform that gets nowhere says so; one that moves does not, whatever its velocity reads."""

from __future__ import annotations

import numpy as np

from base.progress import STUCK, Progress


def said(speed: float) -> str:
    """After five seconds of commands, with a velocity that reads zero, at this true speed [m/s]."""
    progress, command = Progress(), np.array([0.2, 0.0, 0.0])
    reason = ""
    for k in range(round((STUCK + 2.0) / 0.05)):
        place = np.array([speed * 0.05 * k, 0.0])
        reason = progress.check(0.05 * k, command, command, command, np.zeros(3), place, False)
    return reason


def test_a_platform_that_stays_where_it_is_is_stuck() -> None:
    """Told to drive, it does not move."""
    assert said(0.0).startswith("stuck")


def test_an_observer_without_velocity_makes_nobody_stuck() -> None:
    """The pose moves on: `hold` says nothing of velocity."""
    assert said(0.1) == ""
