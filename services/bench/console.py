"""What console and recorder cost the arm: its loop's lateness with and without them, in one run.

The robot runs live all the time. Blocks with both processes (and no browser) take turns with blocks
without, in the order off, on, on, off, so that a machine that grows busier tells against neither.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from services.messages import Health
from services.requests import NoAnswer, ask
from services.topics import CONSOLE, HEALTH, RECORDER, SERVICES, Topic
from services.wire.bus import Bus, open_bus
from services.wire.endpoints import local, make_run_dir, scenario_file
from sim.scenario import Scenario

ROBOT = "bench"
SETTLE = 3.0
"""After processes were started or ended, before anything is measured [s]."""
START = 60.0
"""For a process to be heard [s]."""
BESIDE = (RECORDER, CONSOLE)
GOAL = 1.10
"""Lateness with them over lateness without, at most."""


@dataclass(frozen=True)
class Block:
    """One block: whether console and recorder ran, and how late the arm's ticks were.

    Attributes:
        on: they ran.
        p99: median over the block's heartbeats (five a second) of the 99th percentile [s].
        longest: latest tick [s].
        missed: ticks left out.
        beats: heartbeats heard.
    """

    on: bool
    p99: float
    longest: float
    missed: int
    beats: int


def measure(
    scenario: Scenario,
    pairs: int,
    seconds: float,
    rt: str,
    tell: Callable[[Block], None],
    beside: Sequence[str] = BESIDE,
) -> dict[str, Any]:
    """Run the robot and measure.

    Args:
        scenario: what it does; its program is started anew in each block.
        pairs: blocks with, and as many without.
        seconds: length of a block.
        rt: real-time priority and cores: auto, on, off.
        tell: of each block when it is done.
        beside: what runs in the blocks with: of ``BESIDE``.

    Raises:
        NoAnswer: a process did not come up.
    """
    blocks: list[Block] = []
    with TemporaryDirectory(prefix="sh") as folder, contextlib.ExitStack() as running:
        run_dir = make_run_dir(Path(folder) / "r")
        scenario_file(run_dir).write_text(str(scenario.path.resolve()), encoding="utf-8")
        epoch = time.monotonic()
        topics = list(HEALTH.values())
        bus = running.enter_context(open_bus(local(run_dir, "supervisor"), ROBOT, "bench", topics))

        def service(name: str) -> list[str]:
            args = ["-m", "services.live.process", "--service", name, "--run-dir", str(run_dir)]
            args += ["--scenario", str(scenario.path.resolve()), "--robot", ROBOT, "--rt", rt]
            args += ["--services", ",".join(scenario.services), "--epoch", repr(epoch)]
            return [*args, "--log", str(Path(folder) / f"{len(blocks)}.mcap")]

        for name in (n for n in SERVICES if n in scenario.services):
            running.enter_context(_process(service(name), Path(folder) / f"{name}.log"))
            _await(bus, HEALTH[name])
        page = ["-m", "services.console.live", "--robot", ROBOT, "--run-dir", str(run_dir)]
        page += ["--port", "0"]
        for number in range(2 * pairs):
            on = number % 4 in (1, 2)
            with contextlib.ExitStack() as others:
                if on:
                    for other in beside:
                        args = service(other) if other == RECORDER else page
                        log = Path(folder) / f"{other}.log"
                        others.enter_context(_process(args, log))
                        _await(bus, HEALTH[other])
                with contextlib.suppress(NoAnswer):  # refused while the last one still runs
                    ask(bus.session, ROBOT, "arm", "start", {})
                time.sleep(SETTLE)
                block = _block(on, _beats(bus, seconds))
            blocks.append(block)
            tell(block)
    return figures(blocks)


def figures(blocks: list[Block]) -> dict[str, Any]:
    """Medians with and without, and the median ratio of a block to its neighbour."""
    with_, without = ([b for b in blocks if b.on == on] for on in (True, False))
    ratios = [a.p99 / b.p99 for a, b in zip(with_, without, strict=True) if b.p99 > 0]
    ratio = median(ratios) if ratios else None
    return {
        "p99_with_ms": median(b.p99 for b in with_) * 1e3,
        "p99_without_ms": median(b.p99 for b in without) * 1e3,
        "ratio": ratio,
        "ratios": ratios,
        "goal": GOAL,
        "met": ratio is not None and ratio <= GOAL,
        "blocks": [asdict(block) for block in blocks],
    }


def _block(on: bool, beats: list[Health]) -> Block:
    if not beats:
        raise NoAnswer("the arm fell silent")
    return Block(
        on,
        median(beat.lateness.get("p99", 0.0) for beat in beats),
        max(beat.lateness.get("max", 0.0) for beat in beats),
        beats[-1].overruns - beats[0].overruns,
        len(beats),
    )


def _beats(bus: Bus, seconds: float) -> list[Health]:
    """The arm's heartbeats from now on, for so long."""
    topic = HEALTH["arm"]
    bus.take(topic)
    beats, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.1)
        beats += [beat for _, beat in bus.take(topic)]
    return beats


def _await(bus: Bus, topic: Topic[Health]) -> None:
    bus.take(topic)
    deadline = time.monotonic() + START
    while not bus.take(topic):
        if time.monotonic() > deadline:
            raise NoAnswer(f"{topic.owner} did not come up")
        time.sleep(0.05)


@contextlib.contextmanager
def _process(args: list[str], log: Path) -> Iterator[None]:
    with log.open("ab") as file:
        process = subprocess.Popen([sys.executable, *args], stdout=file, stderr=file)
        try:
            yield
        finally:
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
