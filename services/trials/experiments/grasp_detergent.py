"""Slides a finger against a virtual one over a detergent bottle to a grasp; optionally lifts it.

The thesis' experiment 4 (Platt, section 4.6): 31 trials; the palm comes from the side.
"""

from __future__ import annotations

from pathlib import Path

from arm.hand.plan import FROM_THE_SIDE
from services.trials import hand_pictures
from services.trials.experiment import Row
from services.trials.hand_experiment import Options, run_thing
from services.trials.hand_figures import lines
from services.trials.lines import Line

__all__ = ["Options", "pictures", "run", "summary"]

TILT = (0.7, 1.4)
"""Of reaches, between palm and axis [rad]."""


def run(seed: int, options: Options) -> Row:
    """One trial, and its figures."""
    return run_thing(seed, options, "detergent", FROM_THE_SIDE, TILT)


def summary(rows: list[Row]) -> list[Line]:
    """How often it found a grasp, how fast, and how good the grasps are."""
    return lines(rows, goal=0.98)


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """Figs 4.13 and 4.15 of the thesis, from these trials."""
    return hand_pictures.pictures(rows, folder)
