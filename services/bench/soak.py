"""A live robot for long, disturbed all the time: does anything grow?

Memory, open handles and threads of every process, and how late the arm's ticks are, over time.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import psutil

from services.bench.live_robot import robot, to_work
from services.messages import AT_WORK
from services.requests import NoAnswer
from services.script import Connection, Refused, Silent
from services.topics import ARM_STATUS, HEALTH, RECORDER

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GOAL = 1.0
"""Growth of memory after warm-up, at most [MB/h]."""
WARM_UP = 0.25
"""Share of the time that is not judged."""
EVERY = 2.0
"""Time between samples [s]."""
LOST = ": lost"
"""Ends what a heartbeat calls messages that did not come."""
PUSH_EVERY = 15.0
"""Time between disturbances [s]."""


@dataclass(frozen=True)
class Sample:
    """One process at one time.

    Attributes:
        at: since the start [s].
        service: its name.
        pid: of its process: another one after a restart.
        memory: that is its own alone [MB].
        handles: open files and sockets.
        threads: running.
    """

    at: float
    service: str
    pid: int
    memory: float
    handles: int
    threads: int


@dataclass(frozen=True)
class Soak:
    """What was seen.

    Attributes:
        seconds: how long.
        samples: of all processes.
        lateness: time [s] and p99 of the arm's ticks [s] at its heartbeats.
        disturbances: that were accepted.
        interruptions: states the arm went into that are not work, with their reasons.
        lost: messages that the recorder did not hear, by topic.
        logged: size of the log [MB].
    """

    seconds: float
    samples: list[Sample]
    lateness: list[tuple[float, float]]
    disturbances: int
    interruptions: list[str]
    lost: dict[str, int]
    logged: float


def soak(
    run_dir: Path, scenario: str, seconds: float, seed: int, told: Callable[[float], None]
) -> Soak:
    """Let a robot work, disturb it, and watch.

    Args:
        run_dir: for its sockets and logs.
        scenario: what it does; begun anew whenever it has ended.
        seconds: how long.
        seed: of the disturbances.
        told: how far it is [s].

    Raises:
        Silent, TimeoutError: the robot did not come up, or fell silent.
    """
    rng = np.random.default_rng([seed, 12])
    samples: list[Sample] = []
    lateness: list[tuple[float, float]] = []
    interruptions: list[str] = []
    disturbances, push_at = 0, PUSH_EVERY
    log = run_dir / "log"
    with robot(run_dir, scenario, "--seed", str(seed), "--out", str(log)) as (up, line):
        to_work(line)
        began = time.monotonic()
        health = line.messages(HEALTH["arm"])
        due = 0.0
        while (now := time.monotonic() - began) < seconds:
            lateness.append((now, next(health).lateness.get("p99", 0.0)))
            status = line.latest(ARM_STATUS)
            if status.state not in AT_WORK:
                if status.state != "finished":
                    interruptions.append(f"{now:.0f} s: {status.state}: {status.reason}")
                with contextlib.suppress(Silent):
                    to_work(line, 10.0)
            if now >= push_at:
                push_at += PUSH_EVERY
                disturbances += _disturb(line, rng)
            if now >= due:
                due += EVERY
                working = {line.latest(topic).pid for topic in HEALTH.values()}
                samples += _sample(up, now, working)
                told(now)
        refused = line.latest(HEALTH[RECORDER]).refused
        lost = {n.removesuffix(LOST): k for n, k in refused.items() if n.endswith(LOST)}
        logged = sum(file.stat().st_size for file in log.glob("*.mcap")) / 1e6
    return Soak(seconds, samples, lateness, disturbances, interruptions, lost, logged)


def _disturb(line: Connection, rng: np.random.Generator) -> bool:
    with contextlib.suppress(Refused, NoAnswer):
        line.disturb(
            "push", force=float(rng.uniform(50.0, 150.0)), duration=0.3,
            direction=float(rng.uniform(0.0, 360.0)),
        )  # fmt: skip
        return True
    return False


def _sample(up: psutil.Popen, now: float, working: set[int]) -> list[Sample]:
    out = []
    for process in (psutil.Process(up.pid), *up.children()):
        with contextlib.suppress(psutil.Error), process.oneshot():
            words = process.cmdline()
            name = words[words.index("--service") + 1] if "--service" in words else "supervisor"
            name = "console" if "services.console.live" in words else name
            name += " spare" if "--spare" in words and process.pid not in working else ""
            memory = process.memory_full_info().uss / 1e6
            out.append(
                Sample(now, name, process.pid, memory, process.num_fds(), process.num_threads())
            )
    return out


def figures(found: Soak) -> dict[str, Any]:
    """Growth by service after warm-up, lateness in both halves, and what interrupted the arm.

    A service that was restarted has no growth.
    """
    services: dict[str, Any] = {}
    for name in sorted({s.service for s in found.samples}):
        mine = [s for s in found.samples if s.service == name and s.at > WARM_UP * found.seconds]
        if len(mine) < 3:
            continue
        at = np.array([s.at for s in mine]) / 3600.0
        memory, handles, threads = (
            np.array([getattr(s, what) for s in mine]) for what in ("memory", "handles", "threads")
        )
        one = len({s.pid for s in mine}) == 1
        services[name] = {
            "memory_mb": float(memory[-1]),
            "memory_mb_per_h": float(np.polyfit(at, memory, 1)[0]) if one else None,
            "handles": [int(handles[0]), int(handles[-1])],
            "threads": [int(threads[0]), int(threads[-1])],
        }
    late = np.array(found.lateness)
    halves = (late[late[:, 0] < found.seconds / 2], late[late[:, 0] >= found.seconds / 2])
    slopes = [s["memory_mb_per_h"] for n, s in services.items() if n != "recorder"]
    return {
        "seconds": found.seconds,
        "services": services,
        "arm_p99_ms": [1e3 * float(np.median(half[:, 1])) for half in halves],
        "disturbances": found.disturbances,
        "interruptions": found.interruptions,
        "lost": found.lost,
        "log_mb_per_min": found.logged / found.seconds * 60.0,
        "goal_mb_per_h": GOAL,
        "met": all(slope is not None and slope <= GOAL for slope in slopes),
    }


def picture(found: Soak) -> Figure:
    """Memory, handles and threads of every process, and the arm's lateness, over time."""
    from matplotlib.figure import Figure as NewFigure

    figure = NewFigure(figsize=(9.0, 8.0), layout="constrained")
    axes = figure.subplots(4, 1, sharex=True)
    rows = (("memory", "own memory [MB]"), ("handles", "open handles"), ("threads", "threads"))
    for name in sorted({s.service for s in found.samples}):
        mine = [s for s in found.samples if s.service == name]
        for ax, (what, label) in zip(axes, rows, strict=False):
            ax.plot([s.at / 60.0 for s in mine], [getattr(s, what) for s in mine], label=name)
            ax.set_ylabel(label)
    late = np.array(found.lateness)
    axes[3].plot(late[:, 0] / 60.0, 1e3 * late[:, 1], lw=0.6)
    axes[3].set(ylabel="arm: p99 late [ms]", xlabel="time [min]", yscale="log")
    axes[0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    axes[0].set_title(f"A live robot for {found.seconds / 60:.0f} min, pushed every 15 s")
    return figure
