"""The samples of the grasp's graph as they are shipped, in the order of their trials' seeds."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable
from pathlib import Path

from arm.grasping.graph import Sample
from services.trials.experiment import Row

FILE = Path(__file__).parent / "grasp_graph_samples.toml"
"""Written by ``steadyhand trials grasp-graph``, into its folder."""


def samples_of(rows: Iterable[Row]) -> list[Sample]:
    """What a graph is made of, from rows of ``grasp-graph``."""
    return [Sample(s, a, b, t, bool(harm)) for row in rows for s, a, b, t, harm in row["steps"]]


def read(path: Path = FILE) -> list[Sample]:
    """The samples of a file.

    Raises:
        OSError: there is no such file.
        ValueError: it is no TOML, or holds no steps.
    """
    held = tomllib.loads(path.read_text(encoding="utf-8"))
    trials = held.get("trial", [])
    if not trials or any("steps" not in trial for trial in trials):
        raise ValueError(f"{path}: no [[trial]] with steps")
    return samples_of(trials)


def write(rows: Iterable[Row], path: Path) -> Path:
    """Write rows of ``grasp-graph``; returns the file."""
    text = "# Sampled by grasp-graph: state, controller, next state, seconds, harm.\n"
    for row in rows:
        steps = "".join(f"    {json.dumps(step)},\n" for step in row["steps"])
        text += f"\n[[trial]]\nsteps = [\n{steps}]\n"
    path.write_text(text, encoding="utf-8")
    return path
