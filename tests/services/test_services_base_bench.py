"""The platform's bench: its runs, and what it makes of them."""

from __future__ import annotations

from typing import Any

from services.bench.base import CASES, Job, run_one
from services.bench.base_goals import GOALS
from services.cli.bench_base import _cell, summary


def test_a_run_is_the_same_twice_and_keeps_the_limits() -> None:
    """Equal seeds, equal figures, times of computing apart; acceleration and jerk in limits."""
    first, second = (run_one(Job("position", "optimum", 3)) for _ in range(2))
    timing = {"step_ms", "scan_ms", "step_p99_ms"}
    keys = [k for k in first if k not in timing and first[k] == first[k]]
    assert [first[k] for k in keys] == [second[k] for k in keys]
    assert first["arrived"] and first["own_mm"] <= 5.0
    assert first["jerk_of_limit"] <= 1 + 1e-6 and first["acceleration_of_limit"] <= 1 + 1e-6


def result(rule: str, **figures: Any) -> dict[str, Any]:
    """Of a run in clutter that is perfect but for the figures."""
    perfect = {g.figure: 0.0 for g in GOALS if g.case == "clutter"}
    return {**perfect, "case": "clutter", "rule": rule, "arrived": True, **figures}


def test_a_single_collision_misses_the_goal_of_its_rule_alone() -> None:
    """Rules are judged side by side; cases that were not run have no row."""
    rows = summary(
        [result("optimum"), result("weighted"), result("weighted", collided=True)],
        ("optimum", "weighted"),
    )
    collisions = next(r for r in rows if r["figure"] == "clutter: collisions")
    assert collisions["met"] == {"optimum": True, "weighted": False}
    assert {r["case"] for r in rows} == {"clutter"}


def test_every_goal_is_of_a_case_that_there_is() -> None:
    """No figure of a case that is never run."""
    assert {g.case for g in GOALS} <= set(CASES)


def test_the_table_says_of_each_figure_with_a_goal_whether_it_is_met() -> None:
    """In words, not by colour alone."""
    assert "0.5 met" in _cell(0.5, True) and "2 missed" in _cell(2.0, False)
    assert _cell(3.0, None) == "3" and _cell(None, None) == "-"
