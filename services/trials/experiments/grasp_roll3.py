"""Slides three fingers over a towel roll to a grasp, by touch alone; optionally lifts it.

The thesis' experiment 2 (Platt, section 4.6): 61 trials, palms from above to the side.
"""

from __future__ import annotations

from pathlib import Path

from arm.hand.plan import THREE
from services.trials import hand_pictures
from services.trials.experiment import Row
from services.trials.hand_experiment import Options, run_thing
from services.trials.hand_figures import lines
from services.trials.lines import Line

__all__ = ["Options", "pictures", "run", "summary"]

TILT = (0.0, 1.3)
"""Of reaches, between palm and axis [rad]."""


def run(seed: int, options: Options) -> Row:
    """One trial, and its figures."""
    return run_thing(seed, options, "roll", THREE, TILT)


def summary(rows: list[Row]) -> list[Line]:
    """How often it found a grasp, how fast, and how good the grasps are."""
    return lines(rows, goal=0.95)


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """Figs 4.8, 4.10 and 4.11 of the thesis, from these trials."""
    return hand_pictures.pictures(rows, folder)
