"""Grasps with floating contacts: every controller on every object from the same random starts.

No hand, no friction, touch that is exact or has noise: the ceiling of what a grasp controller can
do, and what is to be expected of each before a hand is in the way (docs/grasp_control.md).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import numpy as np
from pydantic import Field, field_validator

from arm.hand.virtual import Variant
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.floating_run import Controller, Fingers, Setting, Start, grasp
from services.trials.lines import Line, middle, share
from sim.surfaces import OBJECTS

CASES = (
    "cylinder two",
    "cylinder three",
    "cylinder virtual",
    "box virtual",
    "box three",
    "ellipsoid three",
    "ellipsoid virtual",
    "squirt virtual",
    "detergent virtual",
)
PHYSICAL_ONLY = ("curvature", "printed", "corrected")


class Options(Base):
    """What may be chosen."""

    cases: tuple[str, ...] = CASES
    """Object and fingers."""
    controllers: tuple[Controller, ...] = ("sum", "C*", "C* fallback", "force")
    """Also null, curvature, printed, corrected, probing. Pictures are drawn of the first."""
    variant: Variant = "renormalised"
    start: Start = "rays"
    tip: float = Field(default=0.0, ge=0.0, le=0.03)
    """Radius of the tips; 0 for points [m]."""
    noise: float = Field(default=0.0, ge=0.0, le=0.5)
    """Standard deviation of a normal felt [rad]."""
    alpha: float = Field(default=0.04, gt=0.0, le=0.2)
    updates: int = Field(default=400, ge=1, le=5000)

    @field_validator("cases")
    @classmethod
    def _known(cls, cases: tuple[str, ...]) -> tuple[str, ...]:
        for case in cases:
            thing, _, fingers = case.partition(" ")
            if thing not in OBJECTS or fingers not in get_args(Fingers):
                raise ValueError(
                    f"a case is one of {', '.join(OBJECTS)} and one of "
                    f"{', '.join(get_args(Fingers))}, as 'box three'; not {case!r}"
                )
        return cases


def run(seed: int, options: Options) -> Row:
    """Every case with every controller that suits it, all from the start that the seed gives."""
    fixed = options.model_dump(exclude={"cases", "controllers"})
    setting = Setting(**fixed)
    row: Row = {}
    for case in options.cases:
        thing, _, fingers = case.partition(" ")
        row[case] = {
            controller: grasp(thing, fingers, controller, seed, setting)  # type: ignore[arg-type]
            for controller in options.controllers
            if fingers != "virtual" or controller not in PHYSICAL_ONLY
        }
    return row


def summary(rows: list[Row]) -> list[Line]:
    """How often each controller converged, how soon, and how good the grasps are."""
    lines = []
    for case, controllers in cells(rows).items():
        for controller, trials in controllers.items():
            name = f"{case}, {controller}: "
            good = [t for t in trials if t["success"]]
            lines.append(share(name + "converged", (t["success"] for t in trials)))
            lines.append(middle(name + "updates", (t["updates"] for t in good)))
            lines.append(middle(name + "|ρ| at the end", (t["rho"] for t in trials)))
            lines.append(share(name + "ε > 0 at μ 0.3", (t["epsilon"][0] > 0 for t in trials)))
            lines.append(middle(name + "ε at μ 0.5", (t["epsilon"][1] for t in good)))
            lines.append(share(name + "|ρ| rises < 0.03", (t["rise"] < 0.03 for t in good)))
            if any(t["seconds"] is not None for t in good):
                lines.append(middle(name + "time [s]", (t["seconds"] for t in good)))
    return lines


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """Success by controller; residuals and orientations of the first controller."""
    from services.reports.style import save
    from services.trials import floating_pictures as draw

    found = cells(rows)
    first = next(iter(next(iter(found.values()))))
    mine = {case: controllers[first] for case, controllers in found.items() if first in controllers}
    return save(
        folder,
        [
            ("grasp_floating_success", draw.success(found)),
            ("grasp_floating_residuals", draw.residual_curves(mine, first)),
            ("grasp_floating_orientations", draw.densities(mine, first)),
        ],
    )


def show(seed: int, options: Options, folder: Path) -> Row:
    """One trial's residuals, a column a case, all controllers."""
    import matplotlib.pyplot as plt

    from services.reports.style import save

    row = run(seed, options)
    figure, axes = plt.subplots(2, len(row), figsize=(3.0 * len(row), 5.0), squeeze=False)
    for column, (case, controllers) in zip(axes.T, row.items(), strict=True):
        for controller, trial in controllers.items():
            for axis, values in zip(column, np.array(trial["curve"]).T, strict=True):
                axis.plot(values, label=controller)
        column[0].set_title(case)
    axes[0, 0].legend()
    save(folder, [("residuals", figure)])
    return row


def cells(rows: list[Row]) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """The trials by case and controller."""
    return {
        case: {controller: [row[case][controller] for row in rows] for controller in controllers}
        for case, controllers in (rows[0] if rows else {}).items()
    }
