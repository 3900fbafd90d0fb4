"""Lifts the box by the fixed sequence and by the learned policy, on the same seed."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from arm.grasping.graph import SEQUENCE, Graph, safe_actions
from arm.grasping.learning import Policy, greedy, learn, process_of
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.experiments.grasp_graph import begin, row_of
from services.trials.grasp_graph_samples import read
from services.trials.grasp_steps import run_steps
from services.trials.lines import Line, middle, share

EPISODES = 3_000
"""Of Q-learning on the sampled process."""
LEAST = 2
"""Controllers that were run less often in a state are not trusted there."""


class Options(Base):
    """What may be chosen."""

    start: Literal["far", "front", "both"] = "both"
    impulse: float = Field(default=0.0, ge=0.0, le=80.0)
    """Of a push of a forearm [N s]."""
    budget: float = Field(default=45.0, gt=0.0, le=60.0)
    """Time of a trial [s]."""


@cache  # shipped samples do not change while a process lives
def learned(seed: int = 0) -> dict[str, str]:
    """The policy learned from the samples that are shipped; the fixed sequence where none is."""
    process = process_of(Graph.of(read()), LEAST)
    return {**SEQUENCE, **greedy(learn(process, EPISODES, seed).q)}


def run(seed: int, options: Options) -> Row:
    """Two trials in lockstep, alike but for the policy."""
    rng = np.random.default_rng([seed, 12])
    push = (float(rng.uniform(1.0, 8.0)), options.impulse) if options.impulse else None
    out: Row = {}
    policies: dict[str, Policy] = {"fixed": SEQUENCE, "learned": learned()}
    for name, policy in policies.items():
        scenario = begin(options.start, seed)
        out[name] = row_of(run_steps(scenario, seed, policy.__getitem__, options.budget, push))
    return out


def summary(rows: list[Row]) -> list[Line]:
    """How often each lifted it, how fast, and what harm was done."""
    lines = []
    for name in ("fixed", "learned"):
        mine = [row[name] for row in rows]
        steps = [step for row in mine for step in row["steps"]]
        lines += [
            share(f"lifted, {name}", (row["lifted"] for row in mine)),
            middle(f"time to lift, {name} [s]", (_time(r) for r in mine), statistic=np.mean),
            share(
                f"controllers outside their domain, {name}",
                (step[1] not in safe_actions(step[0]) for step in steps),
                goal=0.0,
                least=False,
                method="exact",
            ),
            share(
                f"controllers that did harm, {name}",
                (bool(step[4]) for step in steps),
                goal=0.0,
                least=False,
                method="exact",
            ),
        ]
    both = [r for r in rows if r["fixed"]["lifted"] and r["learned"]["lifted"]]
    gain = [r["fixed"]["seconds"] - r["learned"]["seconds"] for r in both]
    lines.append(middle("gained, paired [s]", gain, statistic=np.mean))
    return lines


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """The graph that the policy was learned on."""
    from services.reports.style import save
    from services.trials.grasp_graph_picture import draw

    return save(folder, [("grasp_graph", draw(Graph.of(read())))])


def _time(row: Row) -> float | None:
    return row["seconds"] if row["lifted"] else None
