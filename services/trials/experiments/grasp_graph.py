"""Samples where each controller of the grasp leads, by choosing among the safe ones at random."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from arm.grasping.graph import (
    ACTIONS,
    RUNNING,
    SEQUENCE,
    Graph,
    Sample,
    prepares,
    safe_actions,
    shortest,
)
from arm.grasping.learning import process_of, times_by
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.grasp_graph_samples import FILE, samples_of, write
from services.trials.grasp_steps import Choose, Episode, run_steps
from services.trials.lines import Line, middle, share
from sim.scenario import Scenario, load_scenario

SCENARIOS = {"far": "move_to_grasp", "front": "reach_to_grasp"}
PROGRAM = "grasp_actions.hds"
PAIRS = (
    ("towards", "in_front"),
    ("in_front", "close"),
    ("close", "reach"),
    ("close", "parallel"),
    ("reach", "gm"),
    ("gm", "comply"),
    ("comply", "lift"),
    ("parallel", "lift"),
    ("open", "reach"),
    ("back", "rest"),
)
"""Of the prepares graph, those that are told."""
PUSHED = 3
"""Of so many trials one is pushed, at a time drawn from its seed."""


class Options(Base):
    """What may be chosen."""

    start: Literal["far", "front", "both"] = "both"
    choice: Literal["safe", "each", "any"] = "safe"
    """At random among the controllers whose domain has the state; each of those in turn, beginning
    with another by the seed; or at random among all."""
    impulse: float = Field(default=40.0, ge=0.0, le=80.0)
    """Of the push of a forearm [N s]."""
    budget: float = Field(default=30.0, gt=0.0, le=60.0)
    """Time of a trial [s]."""


def begin(start: str, seed: int) -> Scenario:
    """The scenario of a trial: far off, in front of the box, or one or the other by the seed."""
    name = SCENARIOS[("far", "front")[seed % 2] if start == "both" else start]
    scenario = load_scenario(name)
    task = scenario.task.model_copy(update={"program": PROGRAM})
    return scenario.model_copy(update={"task": task, "duration": 90.0})


def run(seed: int, options: Options) -> Row:
    """One trial in lockstep: every controller that was run, from where to where."""
    rng = np.random.default_rng([seed, 11])
    push = None
    if options.impulse and seed % PUSHED == 0:
        push = (float(rng.uniform(1.0, 12.0)), options.impulse)
    choose = {"safe": _safe(rng), "each": _each(seed), "any": _any(rng)}[options.choice]
    return row_of(run_steps(begin(options.start, seed), seed, choose, options.budget, push))


def row_of(episode: Episode) -> Row:
    """Plain data: the steps, and how it ended."""
    return {
        "steps": [list(step) for step in episode.steps],
        "lifted": episode.lifted,
        "seconds": episode.ended - episode.began,
        "pushed": episode.pushed,
        "outside": sum(s not in ACTIONS[a].domain for s, a, *_ in episode.steps),
        "harm": next((step[4] for step in episode.steps if step[4]), ""),
    }


def summary(rows: list[Row]) -> list[Line]:
    """What was sampled, and what harm it did."""
    samples = samples_of(rows)
    return [
        share("lifted", (row["lifted"] for row in rows)),
        share("controllers run outside their domain", (_out(x) for x in samples), least=False),
        share("controllers that did harm", (x.harm for x in samples), method="exact", least=False),
        share(
            "of those inside their domain",
            (x.harm for x in samples if not _out(x)),
            goal=0.0,
            least=False,
            method="exact",
        ),
        middle("controllers a trial", (float(len(row["steps"])) for row in rows)),
        *ways(Graph.of(samples)),
    ]


def ways(graph: Graph) -> list[Line]:
    """What prepares what, and by start the fewest controllers to the lift, with their time [s]."""
    lines = []
    for first, then in PAIRS:
        good, n = prepares(graph, first, then)
        if n:
            label = f"{first} prepares {then}"
            lines.append(share(label, [True] * good + [False] * (n - good), method="exact"))
    process = process_of(graph)
    for state in RUNNING:
        way = shortest(graph, state)
        if way:
            seconds = times_by(process, dict(way))[state]
            label = f"{state}: {', '.join(action for _, action in way)} [s]"
            lines.append(Line(label, seconds, None, None, len(graph.runs[way[0]])))
    return lines


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """The prepares graph, and its samples."""
    from services.reports.style import save
    from services.trials.grasp_graph_picture import draw

    drawn = save(folder, [("grasp_graph", draw(Graph.of(samples_of(rows))))])
    return [*drawn, write(rows, folder / FILE.name)]


def _out(sample: Sample) -> bool:
    return sample.state not in ACTIONS[sample.action].domain


def _safe(rng: np.random.Generator) -> Choose:
    """Among the safe ones, half of the time as the sequence has it, to come everywhere."""

    def choose(state: str) -> str:
        if rng.random() < 0.4:
            return SEQUENCE[state]
        return str(rng.choice(safe_actions(state)))

    return choose


def _each(seed: int) -> Choose:
    """Every safe one in turn: what chance seldom chooses is sampled, too."""
    visits: Counter[str] = Counter()

    def choose(state: str) -> str:
        safe = [name for name in safe_actions(state) if name != "rest" or state == "unstowed"]
        visits[state] += 1
        return safe[(seed + visits[state] - 1) % len(safe)]

    return choose


def _any(rng: np.random.Generator) -> Choose:
    """The same without the domains."""

    def choose(state: str) -> str:
        if rng.random() < 0.4:
            return SEQUENCE[state]
        return str(rng.choice(list(ACTIONS)))

    return choose
