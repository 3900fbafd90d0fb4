"""The report of a run: one HTML file with everything in it."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure

from deploy.tomlfile import BadFile
from services.logs.provenance import scenario_of
from services.logs.runlog import RunLog
from services.reports.consistency import consistency
from services.reports.faults import events_of, faults_of, timeline
from services.reports.labels import GRASP_LABELS, LABELS, PEN_LABELS, PLATFORM_LABELS
from services.reports.live import loops_of
from services.reports.loops import loops
from services.reports.pictures import figures_for
from services.reports.sentences import SENTENCES
from services.run import all_figures, outcome_of
from services.topics import TOPICS
from sim.scenario import Scenario

TITLES = {
    "timeline": "What happened",
    "grasp": "Palms and box",
    "board": "The board",
    "drawing": "The drawing",
    "estimate": "What the observer believed",
    "consistency": "Is the observer as good as it says",
    "force": "Force on the board",
    "torques": "Torques",
    "sharing": "Arm and platform",
    "floor": "The platform's way",
    "loops": "Timing of the loops",
}
"""Sections in their order."""
LONG = 200
"""Metadata longer than this are shown folded."""


@dataclass(frozen=True)
class Section:
    """A picture with what it shows: name, title, one sentence, and PNG as a data URI."""

    name: str
    title: str
    sentence: str
    picture: str


def html_of(log: RunLog, about: Mapping[str, str], notes: Sequence[str], name: str) -> str:
    """The report of a run.

    Args:
        log: of the run.
        about: its metadata.
        notes: what people should know of the log, in words.
        name: of the run, for the title.

    Returns:
        HTML that needs nothing else: style within, pictures as data URIs, no scripts.
    """
    notes = list(notes)
    try:
        with scenario_of(about) as scenario:
            return _rendered(log, about, notes, name, scenario)
    except BadFile as error:
        notes.append(f"without the scenario, and so without what depends on it: {error}")
        return _rendered(log, about, notes, name, None)


def _rendered(
    log: RunLog,
    about: Mapping[str, str],
    notes: list[str],
    name: str,
    scenario: Scenario | None,
) -> str:
    figures = all_figures(log, scenario or Scenario())
    sections = sections_of(log, figures, scenario)
    if about.get("mode") == "lockstep":
        notes.append("Simulated in lockstep: no loop can be late, so there is no timing to show.")
    if about.get("record") == "light":
        notes.append("From a light log: fast topics are thinned, figures of them are coarse.")
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    end = max((log.arrivals(t)[-1] for t in TOPICS.values() if log.series(t)), default=0.0)
    return environment.get_template("page.html").render(
        name=name,
        about={k: v for k, v in about.items() if len(v) <= LONG and "\n" not in v},
        files={k: v for k, v in about.items() if len(v) > LONG or "\n" in v},
        outcome=outcome_of(log),
        seconds=end,
        notes=notes,
        figures=rows_of(figures),
        sections=sections,
        faults=faults_of(log),
        events=events_of(log),
        loops=loops_of(log),
    )


def sections_of(
    log: RunLog, figures: Mapping[str, Any], scenario: Scenario | None
) -> list[Section]:
    """Every picture that the run has data for, in the order of ``TITLES``."""
    draw: dict[str, Any] = figures_for(log, scenario)
    draw |= {"timeline": timeline, "consistency": consistency, "loops": loops}
    out = []
    for name, title in TITLES.items():
        figure = draw[name](log, "") if name in draw else None
        if figure is not None:
            out.append(Section(name, title, SENTENCES[name](log, figures), data_uri(figure)))
    return out


def rows_of(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Figures that mean something in this run, in words."""
    labels = GRASP_LABELS if "lifted" in figures else PEN_LABELS
    rows = [
        (label, f"{figures[key]:.4g}")
        for key, label in (labels | PLATFORM_LABELS | LABELS).items()
        if figures.get(key) is not None
    ]
    lifted = figures.get("lifted")
    return rows if lifted is None else [("box lifted", "yes" if lifted else "no"), *rows]


def data_uri(figure: Figure) -> str:
    """A figure as PNG within a URI; the figure is closed."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    plt.close(figure)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()
