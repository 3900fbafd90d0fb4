"""Benchmarks of the live robot: what they work out, and that they run."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from typing import Any

import pytest

from services.bench.soak import Sample, Soak, figures
from services.cli.bench_faults import _show
from services.faults.processes import Sleeper
from services.live.loop import Answers


def test_answers_are_timed_from_their_own_question() -> None:
    """Answers in any order; one to no question, or a second one, does not count."""
    answers = Answers()
    answers.asked(0.001, 10.0)
    answers.asked(0.002, 10.1)
    answers.answered(0.002, 10.4)
    answers.answered(0.001, 10.1)
    answers.answered(0.001, 99.0)
    answers.answered(7.0, 99.0)
    assert answers.report() == pytest.approx({"p50": 0.1, "p99": 0.3, "max": 0.3})
    assert answers.report() == {}


def test_how_late_a_thread_is_woken_is_seen() -> None:
    """Whoever keeps it from running for a while is in the figure."""
    with Sleeper() as sleeper:
        began = time.monotonic()
        re.match("(a+)+$", 22 * "a" + "b")  # lets nobody else in
        held = time.monotonic() - began
    assert sleeper.latest > 0.5 * held > 0.0


def test_what_the_machine_took_is_beside_the_figure(capsys: pytest.CaptureFixture[str]) -> None:
    """Time to safe, by the wall's and by the robot's clock, and how late a thread was woken."""
    fault = {"kind": "lock", "service": "observer", "safe": 0.064, "by_clock": 0.046}
    fault |= {"woken": 0.018, "ready": 1.2, "whole": True}
    result = {"found": [fault], "orphans": {"ended": 0, "killed": 0}, "force": 2.0}
    _show(result | {"safe": 0.064, "safe_by_clock": 0.046, "noise": 0.018})
    said = " ".join(capsys.readouterr().out.split())
    assert "safe after 64 ms (p99; goal 50), 46 ms by the robot's clock" in said
    assert "woken 18 ms late (p99), and 14 ms are missed" in said


def soaked(slope: float, restart: bool = False) -> dict[str, Any]:
    """Figures of a process that grew by so many MB/h over an hour, after a bigger start."""
    samples = [
        Sample(t, "arm", 2 if restart and t > 2000 else 1, 100.0 + slope * t / 3600.0
               + (50.0 - t / 10.0 if t < 500 else 0.0), 30, 8)
        for t in range(0, 3600, 60)
    ]  # fmt: skip
    return figures(Soak(3600.0, samples, [(0.0, 1e-4), (3000.0, 2e-4)], 3, []))


def test_growth_is_that_after_the_warm_up() -> None:
    """What is given back in the first quarter counts as little as what is taken."""
    assert soaked(0.5)["services"]["arm"]["memory_mb_per_h"] == pytest.approx(0.5)
    assert soaked(0.5)["met"]
    assert not soaked(1.5)["met"]
    assert soaked(0.0)["arm_p99_ms"] == pytest.approx([0.1, 0.2])


def test_of_a_restarted_process_no_growth_is_claimed() -> None:
    """It began anew: the goal is not met."""
    assert soaked(0.0, restart=True)["services"]["arm"]["memory_mb_per_h"] is None
    assert not soaked(0.0, restart=True)["met"]


def bench(*words: str) -> Any:
    """What a benchmark prints as JSON."""
    done = subprocess.run(
        [sys.executable, "-m", "services.cli", "bench", *words, "--json"],
        capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode in (0, 1) and done.stdout, done.stderr  # a goal may be missed
    return json.loads(done.stdout)


@pytest.mark.processes
def test_a_short_soak_sees_every_process() -> None:
    """Memory, handles and threads of all services, the recorder, the page and the supervisor."""
    found = bench("soak", "--minutes", "0.4")
    assert set(found["services"]) >= {"sim", "observer", "base", "arm", "recorder", "supervisor"}
    for service in found["services"].values():
        assert service["memory_mb"] > 10.0
        assert min(service["handles"] + service["threads"]) > 0
    assert found["disturbances"] >= 1
