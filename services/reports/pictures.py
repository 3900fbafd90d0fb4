"""Pictures of a run: which there are, and who draws them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from services.logs.runlog import RunLog
from services.reports.board_picture import board, drawing
from services.reports.bottle import bottled
from services.reports.bottle_picture import bottle
from services.reports.estimate_picture import estimate
from services.reports.floor_picture import floor
from services.reports.force_picture import force
from services.reports.grasp import grasp, palmed
from services.reports.sharing_picture import sharing
from services.reports.style import save
from services.reports.torques_picture import torques
from sim.scenario import Scenario

Draw = Callable[[RunLog, str], Figure | None]


def write_pictures(
    log: RunLog, folder: Path, title: str, scenario: Scenario | None = None
) -> list[Path]:
    """Draw every picture the run has data for; returns the files.

    Args:
        log: of a run.
        folder: where to.
        title: of each picture.
        scenario: that was run; without it there is no picture of the floor.
    """
    drawn = figures_for(log, scenario).items()
    return save(folder, ((name, draw(log, title)) for name, draw in drawn))


def figures_for(log: RunLog, scenario: Scenario | None = None) -> dict[str, Draw]:
    """The pictures that a run may have, by name; each gives None where it has no data for it."""
    out: dict[str, Draw] = {
        "estimate": lambda log, title: estimate(log, title, scenario),
        "torques": torques,
    }
    if bottled(log) is not None:
        out = {"grasp": lambda log, title: bottle(log, title, scenario), **out}
    elif palmed(log) is not None:  # no pen, no board
        out = {"grasp": grasp, **out}
    else:
        out = {"board": board, "drawing": drawing, **out, "force": force, "sharing": sharing}
    if scenario is not None:
        out["floor"] = lambda log, title: floor(log, title, scenario)
    return out
