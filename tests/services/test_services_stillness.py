"""Who hangs is told from who is kept waiting by a busy machine, by pulses and by the kernel."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from patience import until

from services.live.pulse import PERIOD, Pulse, Pulses
from services.live.stillness import AT_ONCE, SILENT, Look, Stillness, look

Start = Callable[[str], int]
LOOK = 0.05
"""Between two looks, as in the supervisor [s]."""


def test_a_pulse_says_that_the_loop_goes_round(tmp_path: Path) -> None:
    """Each at its period at most; of whom, and only since one has last listened."""
    with Pulses(tmp_path) as heard:
        pulses = [Pulse(tmp_path, pid) for pid in (11, 12)]
        assert heard.heard() == set()
        for k in range(100):
            pulses[0].beat(1.0 + k * PERIOD / 100)
        pulses[1].beat(1.0)
        assert heard.heard() == {11, 12}
        pulses[0].beat(1.0 + 1.01 * PERIOD)
        assert heard.heard() == {11}


def test_a_pulse_holds_nobody_up(tmp_path: Path) -> None:
    """Before anybody listens, when nobody reads any more, and after the end."""
    pulse = Pulse(tmp_path, 1)
    pulse.beat(0.0)
    with Pulses(tmp_path) as heard:
        for k in range(1000):
            pulse.beat(1.0 + k)
        assert heard.heard() == {1}
    pulse.beat(2000.0)


def stood_still(looks: list[Look], every: float = LOOK) -> float:
    """What is held against a process at whose last pulse the looks began [s]."""
    said = iter(looks)
    still = Stillness(lambda pid: next(said))
    still.went_round(0.0)
    for k in range(len(looks)):
        still.watch(1, SILENT + k * every)
    return still.seconds


def test_what_is_held_against_a_process() -> None:
    """Stopped or asleep: all time; running: the time it was given; starved, or at a disk: none."""
    ten = range(10)
    all_of_it = pytest.approx(AT_ONCE + 9 * LOOK)
    assert stood_still([("TT", 1.0)] * 10) == all_of_it
    assert stood_still([("SS", 1.0)] * 10) == all_of_it
    assert stood_still([("SR", 1.0 + k * LOOK) for k in ten]) == pytest.approx(9 * LOOK)
    assert stood_still([("SR", 1.0 + 0.1 * k * LOOK) for k in ten]) == pytest.approx(0.9 * LOOK)
    assert stood_still([("RR", 1.0)] * 10) == 0.0
    assert stood_still([("DS", 1.0)] * 10) == 0.0
    assert stood_still([("", 0.0)] * 2) <= 2 * AT_ONCE  # it has died: that is found out elsewhere


def test_a_pulse_forgives_everything() -> None:
    """What counts is one standstill, not many short ones."""
    still = Stillness(lambda pid: ("S", 1.0))
    for k in range(100):
        now = k * 0.2
        still.went_round(now)
        assert still.watch(1, now + 0.1) == 0.0  # not yet looked at
        assert still.watch(1, now + 0.19) <= AT_ONCE


def test_who_looks_late_holds_nothing_against_the_others() -> None:
    """A machine that was paused for a minute has no hung process."""
    assert stood_still([("SS", 1.0)] * 2, every=60.0) <= 2 * AT_ONCE


@pytest.fixture
def run() -> Iterator[Start]:
    """Starts Python programs, which end with the test; each has said one line."""
    running = []

    def start(program: str) -> int:
        argv = [sys.executable, "-c", f"import os\nprint(flush=True)\n{program}"]
        running.append(subprocess.Popen(argv, stdout=subprocess.PIPE))
        assert running[-1].stdout is not None
        running[-1].stdout.readline()
        return running[-1].pid

    yield start
    for process in running:
        process.kill()
        process.wait()


def hung(pid: int) -> bool:
    """Whether a process stands still long enough to be taken to hang, before long."""
    still = Stillness()
    still.went_round(time.monotonic())
    until(lambda: still.watch(pid, time.monotonic()) > 0.4, f"that {pid} hangs", every=LOOK)
    return True


LOCKED = "import re\nre.match('(a+)+$', 60 * 'a' + 'b')"


@pytest.mark.processes
def test_stopped_stuck_and_sleeping_processes_hang(run: Start) -> None:
    """Real ones: what the kernel says of them is understood, however busy the machine is."""
    stopped = run("while True: pass")
    os.kill(stopped, signal.SIGSTOP)
    until(lambda: "T" in look(stopped)[0], "stopped")
    assert hung(stopped)
    assert hung(run(LOCKED))
    assert hung(run("import time\ntime.sleep(1e6)"))


@pytest.mark.processes
def test_a_starved_process_does_not_hang(run: Start) -> None:
    """It would run, but others have its processor: nothing, or nearly so, is held against it."""
    core = min(os.sched_getaffinity(0))
    here = f"os.sched_setaffinity(0, {{{core}}})\n"
    idle = "os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))\n"
    run(f"{here}while True: pass")
    starved = run(f"{here}{idle}while True: pass")
    still = Stillness()
    still.went_round(time.monotonic())
    began, before = time.monotonic(), look(starved)[1]
    while time.monotonic() < began + 2.0:
        still.watch(starved, time.monotonic())
        time.sleep(LOOK)
    given = look(starved)[1] - before
    assert still.seconds <= given + 0.02  # clocks of the kernel tick every 10 ms
    assert still.seconds < 0.4
