"""Controllers of a grasp compared on the full hand: three contacts on a roll, the same starts.

The first reach alone, so that no fallback hides what a controller does.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from arm.hand.plan import THREE
from services.trials import hand_pictures
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.hand_experiment import Controller, run_thing
from services.trials.hand_experiment import Options as One
from services.trials.lines import Line, middle, share

ALL: tuple[Controller, ...] = (
    "sum",
    "null",
    "printed",
    "curvature",
    "sequential",
    "force",
    "moment",
)


class Options(Base):
    """What may be chosen."""

    controllers: tuple[Controller, ...] = ALL
    tilt: tuple[float, float] = (0.0, 1.3)
    """Of reaches, between palm and axis [rad]."""


def run(seed: int, options: Options) -> Row:
    """Every controller from the start that the seed gives."""
    return {
        controller: run_thing(
            seed, One(controller=controller, tries=1), "roll", THREE, options.tilt
        )
        for controller in options.controllers
    }


def summary(rows: list[Row]) -> list[Line]:
    """How often each found a grasp, how soon, and what became of the others."""
    out: list[Line] = []
    for name in rows[0] if rows else ():
        trials: list[dict[str, Any]] = [row[name] for row in rows]
        found = [t for t in trials if t["converged"]]
        out += [
            share(f"{name}: grasp found", (t["converged"] for t in trials)),
            share(f"{name}: stuck", (t["outcome"] == "stuck" for t in trials)),
            middle(f"{name}: updates", (t["updates"] for t in found)),
            middle(f"{name}: |rho| after", (t["rho"][1] for t in found)),
            middle(f"{name}: |M|/r_c after", (t["moment"][1] for t in found)),
            middle(f"{name}: epsilon at friction 0.3", (t["eps_03"] for t in found)),
        ]
    return out


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """Residuals and orientations of each controller, in a folder each."""
    out: list[Path] = []
    for name in rows[0] if rows else ():
        out += hand_pictures.pictures([row[name] for row in rows], folder / name)
    return out
