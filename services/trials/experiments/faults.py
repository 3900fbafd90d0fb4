"""Draws while messages, services, sensors and the world fail by seed; limits, ends, time to safe.

Everything runs in lockstep on simulated time; what is not true of real processes is measured by
``steadyhand bench faults``.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from services.faults.run import drawn
from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.lines import Line, middle, share, worst
from sim.scenario import Scenario, load_scenario

PATIENCE = 40.0
"""Somebody who draws for 10 s undisturbed gives up after this [s]."""


class Options(Base):
    """What may be chosen."""

    scenario: str = "whiteboard_moving"
    program: str = "paper_fragment.hds"


def run(seed: int, options: Options) -> Row:
    """One run with the faults of the seed."""
    return drawn(_scenario(options), seed).row


def show(seed: int, options: Options, folder: Path) -> Row:
    """The same run, with its log."""
    from services.logs.provenance import provenance

    scenario = _scenario(options)
    done = drawn(scenario, seed, keep=True)
    assert done.log is not None
    done.log.write(folder / "run.mcap", provenance(scenario, seed, "ekf"))
    return done.row


def summary(rows: list[Row]) -> list[Line]:
    """Limits, how it ended, and how soon the arm was safe."""
    safe = [s for row in rows for s in row["safe_after_s"]]
    names = sorted({name for row in rows for name in row["used"]})
    return [
        share("no limit left for more than 20 ms", (r["left_s"] <= 0.02 for r in rows), 1.0),
        share("finished, or said where it stopped and why", (r["ended_well"] for r in rows), 1.0),
        share("finished", (r["finished"] for r in rows)),
        share("every service there again", (r["restored"] for r in rows), 1.0),
        *(worst(f"largest share of {name}", (r["used"].get(name) for r in rows)) for name in names),
        share("safe after every loss of an input", (r["never_safe"] == 0 for r in rows), 1.0),
        middle("safe after loss of an input, median [s]", safe),
        middle(
            "safe after loss of an input, p99 [s]",
            safe,
            0.05,
            statistic=lambda x, axis: np.quantile(x, 0.99, axis=axis),
        ),
        worst("safe after loss of an input, largest [s]", safe),
    ]


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """How runs with each kind of fault ended."""
    import matplotlib.pyplot as plt

    from services.reports.style import save

    ends = ("finished", "stated", "neither")
    counts = {end: Counter[str]() for end in ends}
    for row in rows:
        end = "finished" if row["finished"] else "stated" if row["ended_well"] else "neither"
        for kind in {f["kind"] for f in row["faults"]}:
            counts[end][kind] += 1
    kinds = sorted({kind for of in counts.values() for kind in of})
    figure, axes = plt.subplots(figsize=(7, 0.3 * len(kinds) + 1.5), layout="constrained")
    left = np.zeros(len(kinds))
    colours = ("tab:blue", "tab:orange", "tab:red")
    labels = ("finished", "said where it stopped and why", "neither")
    for end, colour, label in zip(ends, colours, labels, strict=True):
        width = np.array([counts[end][kind] for kind in kinds], dtype=float)
        axes.barh(kinds, width, left=left, color=colour, label=label)
        left += width
    axes.set_xlabel("runs with such a fault (most runs have several)")
    figure.legend(loc="outside upper center", ncols=3, frameon=False)
    return save(folder, [("faults", figure)])


def _scenario(options: Options) -> Scenario:
    scenario = load_scenario(options.scenario)
    task = scenario.task.model_copy(update={"program": options.program})
    return scenario.model_copy(update={"task": task, "duration": PATIENCE})
