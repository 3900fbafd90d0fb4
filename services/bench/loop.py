"""How well the arm's loop keeps time, beside what the machine itself can do, in one run.

For every real-time set-up and every load: a loop of 1 kHz that does nothing, a bare round trip over
Zenoh, then the whole robot live. The age of the arm's answers and the bare round trip are taken
alike, by who asks: from before a question is sent until its answer arrives.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from services.bench.live_robot import busy_machine, robot, to_work
from services.messages import Health
from services.requests import NoAnswer
from services.script import Refused, Silent
from services.topics import ARM_STATUS, HEALTH

ROBOT = "r1"
SETTLE = 3.0
"""After the robot began to draw, before anything is measured [s]."""
TRIES = 4
"""Of the bare round trip: its two processes do not always find each other at once."""
LATE, MISSED, AGE = 1e-3, 1e-4, 2.0
"""Goals: share of ticks later than 1 ms, share left out, age over the bare round trip (99 %)."""


@dataclass(frozen=True)
class Block:
    """One set-up under one load.

    Attributes:
        rt: real-time priority, cores and spinning: on, off, auto.
        busy: a program that never rests ran on every core.
        timer: of a loop that does nothing: see ``bare.loop``.
        round_trip: bare: p50, p99, max [s].
        age: from an arm state sent to the command for it heard, alike; of p50 and p99 the median
            over heartbeats, five a second.
        p99: of the lateness of the arm's ticks, median over heartbeats [s].
        longest: latest tick [s].
        late: share of the ticks later than 1 ms.
        missed: share of the ticks left out.
        period: mean and standard deviation of the arm's period [s].
    """

    rt: str
    busy: bool
    timer: dict[str, float]
    round_trip: dict[str, float]
    age: dict[str, float]
    p99: float
    longest: float
    late: float
    missed: float
    period: tuple[float, float]

    @property
    def age_ratio(self) -> float:
        """Age of a command over the bare round trip, 99 % each."""
        return self.age["p99"] / self.round_trip["p99"]

    @property
    def met(self) -> bool:
        """All three goals."""
        return self.late <= LATE and self.missed <= MISSED and self.age_ratio <= AGE


def measure(
    scenario: str, modes: tuple[str, ...], loads: tuple[bool, ...], seconds: float,
    tell: Callable[[Block], None],
) -> list[Block]:  # fmt: skip
    """Every set-up under every load.

    Args:
        scenario: what the robot does; its program is started anew whenever it has ended.
        modes: real-time set-ups.
        loads: whether the machine is busy.
        seconds: length of a block; the baselines take a third of it, at most 20 s each.
        tell: of each block when it is done.

    Raises:
        Silent, TimeoutError: the robot did not come up, or fell silent.
    """
    blocks = []
    for rt, busy in product(modes, loads):
        with TemporaryDirectory(prefix="shl") as folder, busy_machine(busy):
            short = min(seconds / 3.0, 20.0)
            how = ("--seconds", str(short), "--rt", rt)
            timer, round_trip = _bare("loop", *how), _bare_round_trip(Path(folder), *how)
            block = _live(Path(folder) / "r", scenario, seconds, rt, busy, timer, round_trip)
        blocks.append(block)
        tell(block)
    return blocks


def _live(
    run_dir: Path, scenario: str, seconds: float, rt: str, busy: bool,
    timer: dict[str, float], round_trip: dict[str, float],
) -> Block:  # fmt: skip
    beats: list[Health] = []
    age: list[dict[str, float]] = []
    with robot(run_dir, scenario, "--rt", rt) as (_, line):
        to_work(line)
        time.sleep(SETTLE)
        health = line.messages(HEALTH["arm"])
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            beats.append(next(health))
            age.append(line.latest(HEALTH["sim"]).answers)
            if line.latest(ARM_STATUS).state == "finished":
                with contextlib.suppress(Refused, NoAnswer):
                    line.request("arm", "start")
    age = [one for one in age if one]
    if not age:
        raise Silent("the arm answered nothing")
    ticks = beats[-1].progress - beats[0].progress
    weights = [b.progress - a.progress for a, b in pairwise(beats)]
    shares = [b.lateness["over_1ms"] for b in beats[1:]]
    return Block(
        rt, busy, timer, round_trip,
        age={
            "p50": float(np.median([one["p50"] for one in age])),
            "p99": float(np.median([one["p99"] for one in age])),
            "max": max(one["max"] for one in age),
        },
        p99=float(np.median([b.lateness["p99"] for b in beats])),
        longest=max(b.lateness["max"] for b in beats),
        late=float(np.average(shares, weights=weights)),
        missed=(beats[-1].overruns - beats[0].overruns) / ticks,
        period=(
            float(np.median([b.period["mean"] for b in beats])),
            float(np.median([b.period["std"] for b in beats])),
        ),
    )  # fmt: skip


def _bare(*args: str) -> dict[str, float]:
    """What a bare process found."""
    command = [sys.executable, "-m", "services.bench.bare", *args]
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    if said.returncode:
        raise Silent(f"{' '.join(args[:1])} failed: {said.stderr.strip().splitlines()[-1]}")
    found: dict[str, float] = json.loads(said.stdout)
    return found


def _bare_round_trip(folder: Path, *args: str) -> dict[str, float]:
    there = ("--folder", str(folder), *args)
    command = [sys.executable, "-m", "services.bench.bare", "pong", *there]
    # Ctrl-C is for us, who end it; it would print a traceback
    pong = subprocess.Popen(command, start_new_session=True)
    try:
        for left in range(TRIES - 1, -1, -1):
            try:
                return _bare("ping", *there)
            except Silent:
                if not left:
                    raise
        raise AssertionError
    finally:
        pong.kill()
        pong.wait()


def as_figures(blocks: list[Block]) -> list[dict[str, Any]]:
    """Plain data, with what is derived."""
    return [
        {
            "rt": b.rt, "busy": b.busy, "timer": b.timer, "round_trip": b.round_trip, "age": b.age,
            "age_ratio": b.age_ratio, "p99": b.p99, "longest": b.longest, "late": b.late,
            "missed": b.missed, "period": b.period, "met": b.met,
        }
        for b in blocks
    ]  # fmt: skip
