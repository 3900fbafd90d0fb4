"""Slides fingers over an object of your own, a mesh in a file, to a grasp; optionally lifts it."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, field_validator

from arm.hand.plan import FROM_THE_SIDE, PAIR, THREE
from services.trials import hand_pictures
from services.trials.experiment import Row
from services.trials.experiments import grasp_detergent, grasp_roll2, grasp_roll3
from services.trials.hand_experiment import Options as Base
from services.trials.hand_experiment import run_thing
from services.trials.hand_figures import lines
from services.trials.lines import Line
from sim import mesh

__all__ = ["Options", "pictures", "run", "summary"]

PLANS = {
    "three": (THREE, grasp_roll3.TILT),
    "pair": (PAIR, grasp_roll2.TILT),
    "side": (FROM_THE_SIDE, grasp_detergent.TILT),
}
"""Plan, and tilt of its reaches as of the objects it is usual for, from, to [rad]."""


class Options(Base):
    """What may be chosen."""

    file: str = Field(min_length=1)
    """Closed mesh: metres, z upwards; it stands on its lowest point."""
    way: Literal["three", "pair", "side"] = "pair"
    """Three contacts; finger 0 against 1 and 2; the same where there is no room from above."""

    @field_validator("file")
    @classmethod
    def _is_a_mesh(cls, value: str) -> str:
        mesh.read(value)
        return str(Path(value).resolve())


def run(seed: int, options: Options) -> Row:
    """One trial, and its figures."""
    plan, tilt = PLANS[options.way]
    return run_thing(seed, options, options.file, plan, tilt)


def summary(rows: list[Row]) -> list[Line]:
    """How often it found a grasp, how fast, and how good the grasps are."""
    return lines(rows, goal=0.95)


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """Orientation before and after, and residuals, as of the other objects."""
    return hand_pictures.pictures(rows, folder)
