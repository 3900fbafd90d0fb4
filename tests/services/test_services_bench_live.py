"""Benchmarks of the live robot: what they work out, and that they run."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from services.bench.soak import Sample, Soak, figures
from services.cli.bench_faults import _middle_and_largest, _show, _well
from services.faults.processes import Found, Session, Sleeper, summary
from services.live.loop import Answers
from services.script import Silent
from services.topics import ARM_STATUS, HEALTH, SERVICES, TRUTH


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
    fault |= {"woken": 0.018, "ready": 1.2, "never": (), "whole": True}
    result = {"found": [fault], "orphans": {"ended": 0, "killed": 0}, "force": 2.0}
    result |= {"never": {"safe": 0, "ready": 0}}
    _show(result | {"safe": 0.064, "safe_by_clock": 0.046, "noise": 0.018})
    said = " ".join(capsys.readouterr().out.split())
    assert "safe after 64 ms (p99; goal 50), 46 ms by the robot's clock" in said
    assert "woken 18 ms late (p99), and 14 ms are missed" in said


class Deaf:
    """A line to a robot that draws on and on, whatever becomes of its services."""

    def __init__(self, pid: int) -> None:
        self.waited: list[str] = []
        self._pid = pid

    def latest(self, topic: Any, timeout: float = 1.0) -> Any:
        newest = {ARM_STATUS.name: SimpleNamespace(state="running", reason="", t=1.0)}
        return newest.get(topic.name, SimpleNamespace(pid=self._pid))

    def messages(self, topic: Any, timeout: float = 1.0) -> Iterator[Any]:
        while True:
            time.sleep(0.01)
            yield SimpleNamespace(t=1.0, recent=np.zeros((5, 4)))

    def wait_for(self, topic: Any, condition: Any, timeout: float = 1.0) -> Any:
        self.waited.append(topic.name)
        raise Silent("waited in vain")

    def request(self, service: str, verb: str) -> str:
        return "accepted"


@pytest.mark.parametrize(
    ("kind", "service", "awaited", "never"),
    [
        ("kill", "observer", [ARM_STATUS.name, HEALTH["observer"].name], ("safe", "ready")),
        ("stop", "arm", [TRUTH.name, HEALTH["arm"].name], ("safe", "ready")),
        ("kill", "base", [HEALTH["base"].name], ("ready",)),
        ("slow", "arm", [], ()),
    ],
)
def test_what_was_waited_for_in_vain_is_no_such_thing_as_not_applicable(
    tmp_path: Path, kind: str, service: str, awaited: list[str], never: tuple[str, ...]
) -> None:
    """Never safe and never ready are said; of what need not be, neither is."""
    for number in range(len(SERVICES)):
        (tmp_path / f"{number}.ready").touch()
    sleeping = subprocess.Popen(["sleep", "100"])
    try:
        line: Any = Deaf(sleeping.pid)
        found = Session(line, tmp_path, np.random.default_rng(0)).fault(kind, service)
    finally:
        sleeping.kill()
        sleeping.wait()
    assert line.waited == awaited
    assert found.never == never
    assert (found.woken is None) == ("safe" not in never)
    assert found.safe is found.ready is None


def test_what_never_was_is_the_worst_case_and_fails(capsys: pytest.CaptureFixture[str]) -> None:
    """It is in the percentile, in the table and in the exit code."""
    good = Found("kill", "observer", 0.04, 0.04, 0.001, 1.0, (), True, "running")
    unsafe = Found("kill", "observer", None, None, 0.001, 1.0, ("safe",), True, "running")
    gone = Found("kill", "observer", 0.04, 0.04, 0.001, None, ("ready",), True, "running")

    def campaign(*found: Found) -> dict[str, Any]:
        rows = [asdict(f) for f in found]
        orphans = {"ended": 0, "killed": 0}
        return {"found": rows, "orphans": orphans, "force": 2.0, **summary([*found])}

    assert _well(campaign(good, good))
    assert not _well(campaign(good, gone))
    assert not _well(campaign(*[good] * 9, unsafe))
    assert not _well(campaign(good) | {"orphans": {"ended": 1, "killed": 0}})
    assert campaign(good, good)["safe"] == 0.04
    assert campaign(*[good] * 9, unsafe)["safe"] is None
    assert campaign(*[good] * 200, unsafe)["safe"] == 0.04
    assert campaign(*[good] * 200, unsafe)["never"] == {"safe": 1, "ready": 0}
    _show(campaign(good, good, unsafe, gone, gone, gone))
    said = " ".join(capsys.readouterr().out.split())
    assert "never safe (within 1 s): 1; never ready again: 3" in said
    assert "safe after" not in said
    rows = campaign(good, unsafe, gone, gone)["found"]
    assert _middle_and_largest(rows, "safe", 1e3) == "40 (never)"
    assert _middle_and_largest(rows, "by_clock", 1e3) == "40 (never)"
    assert _middle_and_largest(rows, "ready", 1.0) == "never (never)"
    assert _middle_and_largest(rows, "woken", 1e3) == "1.00 (1.00)"
    assert _middle_and_largest([asdict(good)], "ready", 1.0) == "1.00 (1.00)"


def soaked(slope: float, restart: bool = False) -> dict[str, Any]:
    """Figures of a process that grew by so many MB/h over an hour, after a bigger start."""
    samples = [
        Sample(t, "arm", 2 if restart and t > 2000 else 1, 100.0 + slope * t / 3600.0
               + (50.0 - t / 10.0 if t < 500 else 0.0), 30, 8)
        for t in range(0, 3600, 60)
    ]  # fmt: skip
    return figures(Soak(3600.0, samples, [(0.0, 1e-4), (3000.0, 2e-4)], 3, [], {}, 1200.0))


def test_growth_is_that_after_the_warm_up() -> None:
    """What is given back in the first quarter counts as little as what is taken."""
    assert soaked(0.5)["services"]["arm"]["memory_mb_per_h"] == pytest.approx(0.5)
    assert soaked(0.5)["met"]
    assert not soaked(1.5)["met"]
    assert soaked(0.0)["arm_p99_ms"] == pytest.approx([0.1, 0.2])
    assert soaked(0.0)["log_mb_per_min"] == pytest.approx(20.0)


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
    assert found["lost"] == {} and found["log_mb_per_min"] > 1.0


@pytest.mark.processes
def test_a_page_gets_the_robot_and_sees_it_move() -> None:
    """Its shapes first, then pictures, more than one a second however busy the machine."""
    found = bench("page", "--seconds", "4")
    assert 0.0 < found["first"] < 4.0
    assert found["rate"] > 1.0
    assert found["bytes_per_s"] > 1e3
