"""What sampled runs said, for people: a table, and scenarios that replay what went wrong."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from services.programs.control_check import CONFIDENCE, ENOUGH, Edge, Report, needed
from services.programs.control_check_sample import varied
from sim.scenario import Scenario


def write_replays(report: Report, scenario: Scenario, folder: Path) -> dict[int, Path]:
    """Write the scenario of every worst counter-example, for ``steadyhand run FILE --seed S``.

    Returns:
        the file by seed.
    """
    seeds = {e.worst.seed for e in report.failed if e.worst is not None}
    seeds |= {e.stuck for e in report.edges if e.stuck is not None}
    files = {}
    for seed in sorted(seeds):
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{Path(scenario.task.program).stem}-{seed}.toml"
        data = varied(scenario, seed).model_dump(mode="json", exclude_none=True)
        file.write_text("\n".join(f"{key} = {_toml(value)}" for key, value in data.items()) + "\n")
        files[seed] = file
    return files


def _toml(value: Any) -> str:
    """A value as TOML, tables inline."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return json.dumps(value)


def render(report: Report, files: Mapping[int, Path]) -> str:
    """The report as text: what was estimated, a table, counter-examples and chains."""
    head = ("transition", "samples", "inside", "bound", "prepares", "in g", "went on", "refines")
    rows = [(*head, "worst: margin, of, seed")]
    for e in report.edges:
        near = "-" if e.worst is None else f"{e.worst.margin:+.2f} {e.worst.of}, {e.worst.seed}"
        share = e.share if e.bound is not None else None
        rows.append(
            (
                f"{e.source} -[{e.event}]-> {e.target}",
                str(e.samples),
                "-" if share is None else f"{share:.2f}",
                "-" if e.bound is None else f"{e.bound:.2f}",
                e.verdict,
                "-" if e.in_goal is None else f"{e.in_goal}/{e.samples}",
                f"{e.went_on}/{e.judged}" if e.judged else "-",
                e.refines,
                near,
            )
        )
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
    ends = list(report.ends.values())
    runs = f"{len(ends)} sampled run{'' if len(ends) == 1 else 's'}"
    lines += [
        "",
        f"{runs}, {ends.count('finished')} finished. An estimate, no proof: "
        f"bound is the {100 * CONFIDENCE:.0f} %",
        f"Clopper-Pearson lower bound over the variations drawn; prepares needs none outside and "
        f"a bound of {ENOUGH:g}.",
    ]
    lines += [f"  seed {s}: {end}" for s, end in report.ends.items() if end != "finished"]
    for e in report.failed:
        if e.worst is not None:
            where = files.get(e.worst.seed)
            lines.append(
                f"counter-example: {e.source} -> {e.target} at {e.worst.t:.2f} s, outside by "
                f"{-e.worst.margin:.2f} of {e.worst.of}; steadyhand run {where} "
                f"--seed {e.worst.seed}"
            )
    for e in report.edges:
        if e.stuck is not None:
            lines.append(
                f"did not go on: {e.target} after {e.source} -[{e.event}]->; "
                f"steadyhand run {files.get(e.stuck)} --seed {e.stuck}"
            )
    lines += _too_few(report.edges, len(ends))
    lines += [f"refines: {' > '.join(chain)}" for chain in report.chains]
    return "\n".join(lines)


def _too_few(edges: Iterable[Edge], runs: int) -> list[str]:
    """What would lead to a verdict where runs are missing."""
    by_help: dict[str, list[str]] = {}
    for e in edges:
        if e.lacking <= 0:
            continue
        help = "no run took, so nothing is known of"
        if e.samples:
            more = math.ceil(needed() * runs / e.samples)
            help = f"too few runs; --samples {more} may be enough for"
        by_help.setdefault(help, []).append(f"{e.source} -[{e.event}]-> {e.target}")
    return [f"{help}: {', '.join(ways)}" for help, ways in by_help.items()]
